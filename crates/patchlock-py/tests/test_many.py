"""Tests of MultiTracker: same boxes as single trackers, targets added and removed at any frame."""

from __future__ import annotations

import copy
import pickle
import re
import sys
import threading
import time
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import QUICK, configured, follow, numbers

import patchlock

OTHER = (40, 30, 36, 30)


def test_each_target_gets_the_boxes_of_a_tracker_of_its_own(scene, film):
    tracker = patchlock.MultiTracker(threads=2, config=QUICK)
    first, estimate = tracker.add(film[0], scene.truth(0))
    found = {first: [numbers(estimate)]}
    for k, frame in enumerate(film[1:], 1):
        estimates = tracker.update(frame)
        assert list(estimates) == tracker.ids == list(found)
        for number, estimate in estimates.items():
            assert estimate.frame == k and estimate.ms > 0
            found[number].append(numbers(estimate))
        if k == 4:
            second, estimate = tracker.add(frame, OTHER)
            assert (second, estimate.frame) == (2, 4)
            found[second] = [numbers(estimate)]
    assert found[first] == follow(film, scene.truth(0))
    assert found[second] == follow(film[4:], OTHER)


def test_targets_are_removed_and_restarted(scene, film):
    tracker = patchlock.MultiTracker(config=QUICK)
    for _ in range(3):
        tracker.add(film[0], scene.truth(0))
    tracker.remove(2)
    assert (tracker.ids, len(tracker)) == ([1, 3], 2)
    assert set(tracker.update(film[1])) == {1, 3}
    tracker.restart(3, film[1], OTHER)
    alone = patchlock.Tracker(film[1], OTHER, config=QUICK)
    assert numbers(tracker.update(film[2])[3]) == numbers(alone.update(film[2]))
    # Ids are never reused.
    assert tracker.add(film[2], OTHER)[0] == 4
    for target in (1, 3, 4):
        tracker.remove(target)
    assert tracker.update(film[3]) == {}
    assert "ids=[]" in repr(tracker)


@pytest.mark.parametrize("again", [lambda t: pickle.loads(pickle.dumps(t)), copy.deepcopy, copy.copy])
def test_a_copy_gives_the_same_boxes(scene, film, again):
    tracker = patchlock.MultiTracker(threads=2, channels="bgr", config=QUICK)
    tracker.add(film[0], scene.truth(0))
    tracker.add(film[0], OTHER)
    tracker.update(film[1])
    copied = again(tracker)
    assert (copied.threads, copied.channels, copied.config, copied.ids) == (2, "bgr", tracker.config, [1, 2])
    for k, frame in enumerate(film[2:6], 2):
        ours, theirs = tracker.update(frame), copied.update(frame)
        assert [numbers(e) for e in ours.values()] == [numbers(e) for e in theirs.values()]
        assert theirs[1].frame == k
    restored = patchlock.MultiTracker.restore(tracker.snapshot(), channels="bgr", frame=5)
    assert restored.update(film[6]) == tracker.update(film[6])


def test_a_pickle_of_three_targets_has_few_bytes(scene, film):
    tracker = patchlock.MultiTracker()
    for box in [scene.truth(0), OTHER, (100, 60, 40, 50)]:
        tracker.add(film[0], box)
    for frame in film[1:4]:
        tracker.update(frame)
    saved = pickle.dumps(tracker)
    assert len(saved) < 3_000_000 < len(tracker.snapshot())
    again = pickle.loads(saved)
    assert again.snapshot() == tracker.snapshot()
    assert again.update(film[4]) == tracker.update(film[4])
    state, *rest = tracker.__reduce__()[1]
    with pytest.raises(ValueError, match="not a snapshot of a MultiTracker"):
        patchlock.MultiTracker.restore(state[: len(state) // 2])


def test_errors_name_their_cause(scene, film):
    tracker = patchlock.MultiTracker(config=QUICK)
    with pytest.raises(KeyError, match="unknown target 1"):
        tracker.remove(1)
    tracker.add(film[0], scene.truth(0))
    with pytest.raises(KeyError, match="7"):
        tracker.restart(7, film[0], OTHER)
    with pytest.raises(ValueError, match="240x100 pixels, but tracking began on 240x180"):
        tracker.update(film[1][:100])
    with pytest.raises(ValueError, match="outside the frame"):
        tracker.add(film[0], (900, 0, 20, 20))
    with pytest.raises(TypeError, match="four numbers"):
        tracker.add(film[0], 5)
    assert tracker.ids == [1]
    with pytest.raises(ValueError, match="not a snapshot of a MultiTracker"):
        patchlock.MultiTracker.restore(patchlock.Tracker(film[0], OTHER).snapshot())
    with pytest.raises(ValueError, match="at most template_side"):
        patchlock.MultiTracker(configured("paper", large_patch=64))


def test_other_threads_run_while_a_frame_is_tracked(scene, film):
    tracker = patchlock.MultiTracker(configured("paper", particles=2000), threads=1)
    for _ in range(2):
        tracker.add(film[0], scene.truth(0))
    steps: list[float] = []
    done = threading.Event()

    def count() -> None:
        while not done.is_set():
            steps.append(time.perf_counter())
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    begin = time.perf_counter()
    tracker.update(film[1])
    end = time.perf_counter()
    done.set()
    counter.join()
    assert len([step for step in steps if begin < step < end]) >= 5


def test_observing_does_not_change_the_estimate(scene, film):
    tracker, plain = (patchlock.Tracker(film[0], scene.truth(0), QUICK) for _ in range(2))
    replaced = []
    for frame in film[1:]:
        estimate, seen = tracker.update_observed(frame)
        # Without an observer, candidates that can't win are dropped early; the best one is the same.
        assert numbers(estimate) == numbers(plain.update(frame))
        assert seen.particles.shape == (30, 6) and seen.likelihoods.shape == (30,)
        assert seen.best == np.argmax(seen.likelihoods)
        assert np.isfinite(seen.likelihoods[seen.best])
        x, y, w, h = estimate.box
        assert seen.particles[seen.best, :2] == pytest.approx((x + (w - 1) / 2, y + (h - 1) / 2))
        assert seen.candidate.shape == (32, 32) and np.linalg.norm(seen.candidate) == pytest.approx(
            1, abs=1e-5
        )
        assert seen.templates.shape == (10, 32, 32)
        replaced.append(seen.replaced)
        assert (seen.mask is None) == (seen.replaced is None)
    # A template is replaced every fifth frame.
    assert [k for k, index in enumerate(replaced, 1) if index is not None] == [5, 10]


def test_many_targets_are_observed_by_id(scene, film):
    tracker, plain = (patchlock.MultiTracker() for _ in range(2))
    for one in (tracker, plain):
        one.add(film[0], scene.truth(0))
        one.add(film[0], OTHER)
    for frame in film[1:4]:
        estimates, seen = tracker.update_observed(frame)
        assert estimates == plain.update(frame)
        assert list(seen) == [1, 2]
        assert all(isinstance(one, patchlock.CommitteeObservation) for one in seen.values())


def test_robust_shows_its_responses(scene, film):
    tracker, plain = (patchlock.Tracker(film[0], scene.truth(0), model="none") for _ in range(2))
    for k, frame in enumerate(film[1:], 1):
        estimate, seen = tracker.update_observed(frame)
        assert numbers(estimate) == numbers(plain.update(frame))
        assert isinstance(seen, patchlock.RobustObservation)
        assert seen.frame == estimate.frame == k
        assert seen.phase == "tracking" and seen.certainty > 0.5
        # The window is a multiple of the target's size.
        assert seen.side * seen.cell > 2 * max(estimate.box.w, estimate.box.h)
        for response in (seen.tracking_filter, seen.memory):
            assert response.shape == (seen.side, seen.side) and response.dtype == np.float32
            # The estimate is where the filters respond most, within a cell.
            down, right = np.unravel_index(np.argmax(np.fft.fftshift(response)), response.shape)
            assert abs(down - seen.side // 2) <= 1 and abs(right - seen.side // 2) <= 1
    assert f"frame {k}" in repr(seen)


def test_detections_start_and_correct_tracks(scene, monkeypatch):
    """The recipe of docs/many-targets.md, with a made-up detector in place of the two packages."""
    page = (Path(__file__).parents[3] / "docs/many-targets.md").read_text()
    [code] = re.findall(r"```python\n(import patchlock\n[^`]*ultralytics.*?)```", page, re.DOTALL)
    assert len(code.strip().splitlines()) <= 20
    other = (10, 110, 60, 150)

    def shown(number):
        """The detector's box of the target; it is off by a third of its width in frame 10."""
        x, y, w, h = scene.truth(number)
        return patchlock.Box(x + (w / 3 if number == 10 else 0), y, w, h)

    class Yolo:
        def __init__(self, name):
            self.calls = 0

        def __call__(self, frame):
            """It is asked for each tenth frame, and sees a second target from frame 10 on."""
            number = 10 * self.calls
            self.calls += 1
            return [np.array([shown(number).xyxy, other][: 1 if number == 0 else 2])]

    detections = types.SimpleNamespace(from_ultralytics=lambda found: types.SimpleNamespace(xyxy=found))
    monkeypatch.setitem(sys.modules, "ultralytics", types.SimpleNamespace(YOLO=Yolo))
    monkeypatch.setitem(sys.modules, "supervision", types.SimpleNamespace(Detections=detections))
    monkeypatch.setattr(patchlock, "Frames", lambda name: [(k, scene[k]) for k in range(25)])
    names: dict[str, Any] = {}
    exec(compile(code, "many-targets.md", "exec"), names)
    track = names["track"]
    assert [list(found) for found in track] == [[1]] * 10 + [[1, 2]] * 15
    assert all(found[1].frame == number for number, found in enumerate(track))
    # Followed, then put where the detector sees it.
    assert track[9][1].box.iou(scene.truth(9)) > 0.7
    for number in (0, 10, 20):
        assert track[number][1].box == pytest.approx(shown(number)), number
    assert track[10][2].box == pytest.approx(patchlock.Box.from_xyxy(other))
