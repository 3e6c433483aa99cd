"""Runs the same script with one of OpenCV's own trackers and with ours."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import made_up
import numpy as np
import numpy.typing as npt
import pytest

import patchlock
from patchlock.toolkits.cv2 import TrackerPatchlock, TrackerPatchlock_create

FRAMES = 10


def opencv(name: str) -> ModuleType:
    """OpenCV, if it has this tracker; not every build has all of them."""
    cv2 = made_up.toolkit("cv2")
    if os.environ.get("PATCHLOCK_PYTHON") != "required" and not hasattr(cv2, name):
        pytest.skip(f"this OpenCV has no {name}")
    return cv2


def bgr(k: int) -> npt.NDArray[np.uint8]:
    """A frame as OpenCV reads it, in BGR order."""
    return made_up.frame(k)[..., ::-1].copy()


def follow(create: Callable[[], Any]) -> list[tuple[Any, Any]]:
    """A script written for OpenCV's trackers."""
    tracker = create()
    assert tracker.init(bgr(0), tuple(round(value) for value in made_up.box(0))) is None
    return [tracker.update(bgr(k)) for k in range(1, FRAMES)]


@pytest.mark.parametrize("name", ["TrackerMIL_create", "TrackerCSRT_create"])
def test_results_have_the_types_of_opencv(name: str) -> None:
    cv2 = opencv(name)
    theirs = follow(getattr(cv2, name))
    ours = follow(lambda: TrackerPatchlock_create(config=made_up.CONFIG))
    for k, (their, our) in enumerate(zip(theirs, ours, strict=True), start=1):
        assert [type(part) for part in their] == [type(part) for part in our] == [bool, tuple]
        assert [type(value) for value in their[1]] == [type(value) for value in our[1]] == [int] * 4
        assert our[0]
        np.testing.assert_allclose(our[1], made_up.box(k), atol=5)
        cv2.rectangle(made_up.frame(k), our[1], (0, 0, 255))


@pytest.mark.parametrize("ours", [True, False])
def test_only_one_line_of_a_script_changes(
    ours: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The script in docs/toolkits.md, as written and with the original line."""
    cv2 = opencv("TrackerCSRT_create")
    script = made_up.snippet("python", "VideoCapture")
    if not ours:
        script, count = re.subn(r"= TrackerPatchlock_create\(\) +# was: ", "= ", script)
        assert count == 1
    monkeypatch.chdir(tmp_path)
    height, width = bgr(0).shape[:2]
    video = cv2.VideoWriter("video.mp4", cv2.VideoWriter_fourcc(*"mp4v"), 30, (width, height))
    for k in range(4):
        video.write(bgr(k))
    video.release()
    names: dict[str, Any] = {}
    exec(script, names)
    assert type(names["tracker"]).__module__ == ("patchlock.toolkits.cv2" if ours else "cv2")
    assert names["more"] is False and type(names["ok"]) is bool and len(names["box"]) == 4


def test_the_boxes_are_those_of_tracker() -> None:
    alone = patchlock.Tracker(made_up.frame(0), made_up.box(0), made_up.CONFIG)
    exact = TrackerPatchlock.create(exact=True, threads=1, config=made_up.CONFIG)
    exact.init(made_up.frame(0)[..., ::-1], made_up.box(0))
    for k in range(1, FRAMES):
        estimate = alone.update(made_up.frame(k))
        ok, box = exact.update(made_up.frame(k)[..., ::-1])
        assert ok and box == tuple(estimate.box), "channel order does not matter"
        assert exact.getTrackingScore() == estimate.score
        assert exact.estimate == estimate


def test_a_target_that_is_gone_is_not_ok() -> None:
    tracker = TrackerPatchlock(min_score=0.5, config=made_up.CONFIG)
    tracker.init(made_up.frame(0), made_up.box(0))
    assert tracker.update(made_up.frame(1))[0]
    noise = np.random.default_rng(3).integers(0, 255, made_up.frame(0).shape, dtype=np.uint8)
    ok, box = tracker.update(noise)
    assert not ok and len(box) == 4
    assert tracker.getTrackingScore() < 0.5
    # Unlike OpenCV's trackers, it supports a second init.
    tracker.init(made_up.frame(0), made_up.box(0))
    assert tracker.update(made_up.frame(1))[0]


@pytest.mark.parametrize("status", ["tracked", "uncertain", "lost"])
def test_a_lost_target_is_not_ok_whatever_its_score(monkeypatch: pytest.MonkeyPatch, status: Any) -> None:
    """With a stand-in for the tracker, which reports this status."""

    class Stub:
        estimate = patchlock.Estimate((10.25, 20, 30, 15), [(0, 0)] * 4, 0.9, status)

        def __init__(self, *args: Any, **options: Any) -> None: ...

        def update(self, image: Any) -> patchlock.Estimate:
            return self.estimate

    monkeypatch.setattr("patchlock.toolkits.cv2.Tracker", Stub)
    tracker = TrackerPatchlock(exact=True)
    tracker.init(made_up.frame(0), made_up.box(0))
    assert tracker.update(made_up.frame(1)) == (status != "lost", (10.25, 20, 30, 15))
    assert tracker.estimate is not None and tracker.estimate.status == status


def test_errors_name_their_cause() -> None:
    tracker = TrackerPatchlock(config=made_up.CONFIG)
    with pytest.raises(RuntimeError, match="init"):
        tracker.update(made_up.frame(0))
    with pytest.raises(RuntimeError, match="init"):
        tracker.getTrackingScore()
    with pytest.raises(ValueError, match="outside"):
        tracker.init(made_up.frame(0), (500, 500, 10, 10))
    with pytest.raises(ValueError, match="min_score is 2"):
        TrackerPatchlock(min_score=2)
    with pytest.raises(TypeError):
        tracker.init(None, made_up.box(0))  # cv2.imread returns None for a missing file
