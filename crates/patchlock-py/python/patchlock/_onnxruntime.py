"""Finds the library of the installed package onnxruntime."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

# The library on Linux, macOS and Windows; those of its execution providers have other names.
_NAMES = ("libonnxruntime.so*", "libonnxruntime.*dylib", "onnxruntime.dll")


def library() -> Path:
    """The path of the library, found without importing the package, which would load it.

    Raises:
        ImportError: The package is not installed, or has no such library.
    """
    spec = find_spec("onnxruntime")
    if spec is None or spec.submodule_search_locations is None:
        raise ImportError(
            'runtime="onnxruntime" needs the package onnxruntime: pip install "patchlock[onnxruntime]"'
        )
    folders = [Path(folder) / "capi" for folder in spec.submodule_search_locations]
    found = [path for folder in folders for name in _NAMES for path in sorted(folder.glob(name))]
    if not found:
        raise ImportError(
            f"the installed package onnxruntime has no library {' or '.join(_NAMES)} in {folders[0]}; "
            "give its path with runtime="
        )
    return found[0]
