"""Tests of the package as a whole: stubs, documentation, version."""

from __future__ import annotations

import ast
import inspect
from importlib import metadata, resources

import patchlock
from patchlock import _patchlock


def is_setter(function: ast.FunctionDef) -> bool:
    """Whether it sets a property; the documentation is at the one that reads it."""
    return any(ast.unparse(decorator).endswith(".setter") for decorator in function.decorator_list)


def stub_docs() -> dict[str, str]:
    """The documentation in the stubs, by name."""
    stubs = ast.parse((resources.files("patchlock") / "_patchlock.pyi").read_text())
    found = {}
    for node in stubs.body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            found[node.name] = ast.get_docstring(node) or ""
        if isinstance(node, ast.ClassDef):
            functions = [item for item in node.body if isinstance(item, ast.FunctionDef)]
            methods = [item for item in functions if not is_setter(item)]
            found |= {f"{node.name}.{item.name}": ast.get_docstring(item) or "" for item in methods}
    return found


def test_stubs_and_module_have_the_same_documentation():
    for name, text in stub_docs().items():
        if name.split(".")[-1].startswith("__"):
            continue
        there = _patchlock
        for part in name.split("."):
            there = getattr(there, part)
        assert text == inspect.cleandoc(there.__doc__ or ""), name


def test_everything_public_is_documented():
    for name in patchlock.__all__:
        value = getattr(patchlock, name)
        # Constants and type aliases have no docstring.
        assert not (inspect.isclass(value) or inspect.isroutine(value)) or (value.__doc__ or "").strip(), name


def test_the_package_is_typed_and_has_a_version():
    assert (resources.files("patchlock") / "py.typed").is_file()
    assert metadata.version("patchlock") == patchlock.__version__
