"""Sequences on disk for the toolkits, made from the rendered scene."""

from __future__ import annotations

import importlib
import os
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

import patchlock

SCENE = patchlock.Scene("simple")
SETTINGS = "[paper]\nparticles = 100\n[paper.patches]\nsmall_step = 4\n"
"""A settings file: fast, and accurate enough to follow the scene."""
CONFIG = patchlock.Config("paper")
"""The same settings."""
CONFIG.paper.particles = 100
CONFIG.paper.patches.small_step = 4


def toolkit(name: str) -> ModuleType:
    """Imports the toolkit. Skips the test if it is missing, unless PATCHLOCK_PYTHON=required."""
    if os.environ.get("PATCHLOCK_PYTHON") == "required":
        return importlib.import_module(name)
    return pytest.importorskip(name, exc_type=ImportError)


def snippet(language: str, word: str) -> str:
    """The code block in docs/toolkits.md in this language that contains this word."""
    page = Path(__file__).parents[3] / "docs/toolkits.md"
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)
    (block,) = [block for block in blocks if word in block]
    return str(block)


def frame(k: int, mirrored: bool = False) -> npt.NDArray[np.uint8]:
    """Frame k of the scene, in RGB order."""
    image = SCENE[k]
    return np.ascontiguousarray(image[:, ::-1]) if mirrored else image


def box(k: int, mirrored: bool = False) -> patchlock.Box:
    """The target's true box in frame k."""
    truth = SCENE.truth(k)
    return truth._replace(x=SCENE[k].shape[1] - truth.x - truth.w) if mirrored else truth


def jumps(k: int, count: int) -> bool:
    """Whether frame k is mirrored: the second half is, so that the target jumps out of reach."""
    return 2 * k >= count


def save_frames(folder: Path, count: int, pattern: str, *, jump: bool = False) -> None:
    """The first frames as JPEG files, numbered from 1."""
    folder.mkdir(parents=True)
    for k in range(count):
        image = Image.fromarray(frame(k, jump and jumps(k, count)))
        image.save(folder / (pattern % (k + 1)), quality=95)
