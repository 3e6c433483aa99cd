"""Tests of the package as a whole: stubs, documentation, version, licences."""

from __future__ import annotations

import inspect
import subprocess
import sys
from importlib import metadata, resources
from pathlib import Path

import patchlock


ROOT = Path(__file__).parents[3]


def test_the_stubs_are_those_of_the_module():
    """`./test` writes them again."""
    subprocess.run([sys.executable, ROOT / "tools/python/stubs.py", "--check"], check=True)


def test_everything_public_is_documented():
    for name in patchlock.__all__:
        value = getattr(patchlock, name)
        # Constants and type aliases have no docstring.
        assert not (inspect.isclass(value) or inspect.isroutine(value)) or (value.__doc__ or "").strip(), name


def test_the_package_is_typed_and_has_a_version():
    assert (resources.files("patchlock") / "py.typed").is_file()
    assert metadata.version("patchlock") == patchlock.__version__


def test_the_package_has_its_licences_and_notices():
    names = {path.name for path in metadata.files("patchlock") or [] if "licenses" in path.parts}
    assert {"LICENSE-MIT", "LICENSE-APACHE", "NOTICE.md"} <= names
