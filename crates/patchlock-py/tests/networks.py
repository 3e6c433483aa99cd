"""Networks for the tests: made-up ones of the repository, and real ones beside the checkout."""

from __future__ import annotations

import importlib.util
import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
MADE_UP = ROOT / "crates/patchlock/tests/golden/network"
"""The folder of networks with random weights."""
NANOTRACK = [MADE_UP / "nanotrack_backbone.onnx", MADE_UP / "nanotrack_head.onnx"]
VITTRACK = MADE_UP / "vittrack.onnx"


def nanotrack_in(folder: Path) -> Path:
    """The folder, with the files of the made-up NanoTrack in it."""
    folder.mkdir(parents=True, exist_ok=True)
    for file in NANOTRACK:
        shutil.copy(file, folder)
    return folder


def outside(variable: str, beside: str, name: str) -> Path:
    """The folder `name` of real data, which is not part of the repository.

    It is in the folder that the variable names, or in `../shared` beside the checkout. Without it the test is
    skipped, or fails if the value of the variable is `required`.
    """
    given = os.environ.get(variable)
    default = ROOT.parent / "shared" / beside
    folder = (default if given in (None, "", "required") else Path(given)) / name
    if not folder.is_dir():
        message = f"there is no {folder} ({variable} names the folder around it)"
        if given == "required":
            pytest.fail(message)
        pytest.skip(message)
    return folder


def need_onnxruntime() -> None:
    """Skips the test if onnxruntime is not installed, unless PATCHLOCK_PYTHON=required."""
    if importlib.util.find_spec("onnxruntime") is None and os.environ.get("PATCHLOCK_PYTHON") != "required":
        pytest.skip("needs the extra onnxruntime")
