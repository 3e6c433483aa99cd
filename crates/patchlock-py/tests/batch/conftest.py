"""Clips for the tests of batches: the same frames, with a different seed for each clip."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import patchlock
from patchlock.batch import Clip

SETTINGS = {"particles": 60, "small_step": 4}
"""Settings that differ from the preset `paper`."""


def quick(particles: int = SETTINGS["particles"]) -> patchlock.Config:
    """`SETTINGS` as a configuration, with another number of particles."""
    config = patchlock.Config("paper")
    config.paper.particles = particles
    config.paper.patches.small_step = SETTINGS["small_step"]
    return config


QUICK = quick()
"""Settings with which a clip takes some tenths of a second: long enough to be killed meanwhile."""
FRAMES = 24


@pytest.fixture(scope="session")
def frames(tmp_path_factory: pytest.TempPathFactory, scene: patchlock.Scene) -> Path:
    """A folder of images."""
    folder = tmp_path_factory.mktemp("film") / "simple"
    folder.mkdir()
    for k in range(FRAMES):
        Image.fromarray(scene[k]).save(folder / f"{k:04d}.png")
    return folder


@pytest.fixture(scope="session")
def box(scene: patchlock.Scene) -> tuple[float, float, float, float]:
    return tuple(scene.truth(0))  # type: ignore[return-value]


@pytest.fixture(scope="session")
def clips(frames: Path, box: tuple[float, float, float, float]) -> list[Clip]:
    """Twelve clips whose tracks all differ."""
    return [Clip(frames, box, name=f"clip{k}", seed=k) for k in range(12)]


def boxes_below(out: Path) -> dict[str, str]:
    """Every trajectory below a folder, by path."""
    return {str(path.relative_to(out)): path.read_text() for path in sorted(out.rglob("*.txt"))}


def manifests_below(out: Path) -> dict[str, Any]:
    """The manifest of every run below a folder, without machine-dependent fields.

    Also checks that each manifest matches its boxes.
    """
    found = {}
    for path in sorted(out.rglob("ope/*/*.json")):
        manifest = json.loads(path.read_text())
        boxes = path.with_suffix(".txt").read_bytes()
        assert manifest["boxes_sha256"] == hashlib.sha256(boxes).hexdigest()
        assert len(manifest["seconds"]) == manifest["frames"]
        found[str(path.relative_to(out))] = {
            k: v for k, v in manifest.items() if k not in ("machine", "seconds", "threads", "jobs")
        }
    return found


def leftovers(out: Path) -> list[Path]:
    """Temporary files that were not removed."""
    return list(out.rglob("*.part"))
