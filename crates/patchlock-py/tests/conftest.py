"""A rendered scene for the tests, and settings that are fast rather than accurate."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import patchlock

QUICK: dict[str, Any] = {"method": "patchwise", "particles": 30, "small_step": 8}
"""Settings of the paper's tracker with which a frame takes a few milliseconds."""


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


def follow(tracker: patchlock.Tracker, film: list[Any], box: Any) -> list[tuple[Any, ...]]:
    """The fields of all estimates."""
    return [numbers(tracker.update(frame) if k else tracker.init(frame, box)) for k, frame in enumerate(film)]
