"""A rendered scene for the tests, and settings that are fast rather than accurate."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import patchlock


def configured(preset: str, **changes: Any) -> patchlock.Config:
    """A preset with some settings changed, by name."""
    config = patchlock.Config(preset)
    method = config.paper if preset == "paper" else config.robust
    places = {"": config, "patches": method.patches}
    groups = {parameter.name: parameter.group for parameter in patchlock.parameters(research=True)}
    for name, value in changes.items():
        setattr(places.get(groups[name], method), name, value)
    return config


SETTINGS = {"particles": 30, "small_step": 8}
"""Settings of the paper's tracker with which a frame takes a few milliseconds."""
QUICK = configured("paper", **SETTINGS)
"""The preset `paper` with these settings."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests run only if they are asked for."""
    if os.environ.get("PATCHLOCK_SLOW") == "1":
        return
    for item in items:
        if marker := item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.skip(reason=f"takes {marker.args[0]} s; PATCHLOCK_SLOW=1 runs it"))


@pytest.fixture(scope="session")
def scene() -> patchlock.Scene:
    return patchlock.Scene("simple")


@pytest.fixture(scope="session")
def film(scene: patchlock.Scene) -> list[npt.NDArray[np.uint8]]:
    return [scene[k] for k in range(12)]


def numbers(estimate: patchlock.Estimate) -> tuple[Any, ...]:
    """All fields of an estimate except the time, exact to the last bit."""
    assert estimate.visibility is not None
    large, small = estimate.visibility
    return (
        *estimate.box,
        *estimate.corners.ravel(),
        estimate.score,
        estimate.status,
        large.tobytes(),
        small.tobytes(),
    )


def follow(
    film: list[Any], box: Any, config: patchlock.Config = QUICK, **options: Any
) -> list[tuple[Any, ...]]:
    """The fields of all estimates of a tracker."""
    tracker = patchlock.Tracker(film[0], box, config, **options)
    return [numbers(tracker.estimate), *(numbers(tracker.update(frame)) for frame in film[1:])]
