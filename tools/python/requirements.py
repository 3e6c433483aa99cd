"""Prints the requirements of the Python package and of the extras named as arguments, one per line."""

import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    from pip._vendor import tomli as tomllib

PYPROJECT = Path(__file__).resolve().parents[2] / "crates/patchlock-py/pyproject.toml"

project = tomllib.loads(PYPROJECT.read_text())["project"]
extras = project["optional-dependencies"]
if unknown := [name for name in sys.argv[1:] if name not in extras]:
    sys.exit(f"error: there is no extra {', '.join(unknown)}; the extras are {', '.join(extras)}")
for requirement in project["dependencies"] + [line for name in sys.argv[1:] for line in extras[name]]:
    print(requirement)
