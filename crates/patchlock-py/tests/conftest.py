"""What the tests track: a rendered scene, with a tracker that is quick rather than good."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import patchlock

QUICK: dict[str, Any] = {"particles": 30, "small_step": 8}
"""Settings with which a frame takes a few milliseconds."""


@pytest.fixture(scope="session")
def scene() -> patchlock.Scene:
    return patchlock.Scene("simple")


@pytest.fixture(scope="session")
def film(scene: patchlock.Scene) -> list[npt.NDArray[np.uint8]]:
    return [scene[k] for k in range(12)]


def numbers(estimate: patchlock.Estimate) -> tuple[Any, ...]:
    """Everything that an estimate says, to the last bit, but the time."""
    large, small = estimate.occlusion
    return (*estimate.box, *estimate.corners.ravel(), estimate.likelihood, *estimate.visibility, large.tobytes(), small.tobytes())


def follow(tracker: patchlock.Tracker, film: list[Any], box: Any) -> list[tuple[Any, ...]]:
    """The numbers of all estimates."""
    return [numbers(tracker.update(frame) if k else tracker.init(frame, box)) for k, frame in enumerate(film)]
