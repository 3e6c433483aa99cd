"""Writes the stubs of the Rust part of the Python package, `python/patchlock/_patchlock.pyi`.

The types are those of `stubs/_patchlock.pyi`, which is written by hand. Documentation and settings are
those of the installed module. With `--check` it only compares, and fails if the file is not up to date.
"""

from __future__ import annotations

import ast
import inspect
import sys
import textwrap
from pathlib import Path

import patchlock
from patchlock import _patchlock

PACKAGE = Path(__file__).resolve().parents[2] / "crates/patchlock-py"
TYPES = PACKAGE / "stubs/_patchlock.pyi"
STUBS = PACKAGE / "python/patchlock/_patchlock.pyi"
WIDTH = 100
GROUPS = {
    "Config": "",
    "RobustConfig": "robust",
    "PaperConfig": "paper",
    "NetworkConfig": "network",
    "PatchModelConfig": "patches",
}
HEAD = '"""The Rust part of the package `patchlock`. Written by tools/python/stubs.py."""\n\n'


def docstring(text: str, indent: str) -> list[str]:
    """The lines of a docstring."""
    lines = inspect.cleandoc(text).splitlines()
    lines[0] = f'"""{lines[0]}'
    if len(lines) == 1 and len(indent + lines[0]) + 3 <= WIDTH:
        lines[0] += '"""'
    else:
        lines.append('"""')
    return [f"{indent}{line}".rstrip() for line in lines]


def settings(group: str) -> list[str]:
    """The attributes of a group of settings."""
    lines = []
    for parameter in patchlock.parameters():
        if parameter.group == group:
            kind = type(parameter.default).__name__
            if kind == "str":
                kind = f"Literal[{', '.join(repr(word) for word in parameter.allowed.split(', '))}]"
            text = f"{parameter.purpose} Allowed: {parameter.allowed}."
            lines.append(f"    {parameter.name}: {kind}".replace("'", '"'))
            lines += docstring("\n".join(textwrap.wrap(text, WIDTH - 7)), "    ")
    return lines


def is_setter(node: ast.FunctionDef) -> bool:
    """Whether it sets a property; the documentation is at the one that reads it."""
    return any(ast.unparse(decorator).endswith(".setter") for decorator in node.decorator_list)


def insertions(node: ast.stmt, scope: object) -> dict[int, list[str]]:
    """The lines to insert for a definition, by the number of the line after which they go."""
    if not isinstance(node, (ast.ClassDef, ast.FunctionDef)):
        return {}
    indent = " " * (node.col_offset + 4)
    here = getattr(scope, node.name)
    found: dict[int, list[str]] = {}
    if isinstance(node, ast.ClassDef):
        found[node.lineno] = [*docstring(here.__doc__, indent), "", *settings(GROUPS.get(node.name, "-"))]
        for inner in node.body:
            found |= insertions(inner, here)
    elif here.__doc__ and not node.name.startswith("__") and not is_setter(node):
        found[node.end_lineno or node.lineno] = [*docstring(here.__doc__, indent), ""]
    return found


def generated() -> str:
    """The text of the stubs."""
    source = TYPES.read_text(encoding="utf-8")
    after: dict[int, list[str]] = {}
    for node in ast.parse(source).body:
        after |= insertions(node, _patchlock)
    lines = []
    for number, line in enumerate(source.splitlines(), 1):
        added = after.get(number)
        lines.append(line.removesuffix(" ...") if added else line)
        lines += added or []
    return HEAD + "\n".join(lines).rstrip() + "\n"


def main() -> None:
    """Writes or compares the file."""
    text = generated()
    if "--check" not in sys.argv[1:]:
        STUBS.write_text(text, encoding="utf-8")
    elif STUBS.read_text(encoding="utf-8") != text:
        sys.exit(f"{STUBS} is not up to date; run tools/python/stubs.py with the installed package")


if __name__ == "__main__":
    main()
