"""Tests of Tracker and Estimate: results, pickling, settings, errors, threads."""

from __future__ import annotations

import copy
import json
import multiprocessing
import os
import pickle
import signal
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import QUICK, SETTINGS, configured, follow, numbers
from networks import VITTRACK, outside
from PIL import Image

import patchlock


def overlap(a: patchlock.Box, b: patchlock.Box) -> float:
    width = min(a.x + a.w, b.x + b.w) - max(a.x, b.x)
    height = min(a.y + a.h, b.y + b.h) - max(a.y, b.y)
    both = max(width, 0) * max(height, 0)
    return both / (a.w * a.h + b.w * b.h - both)


@pytest.mark.parametrize("config", [None, configured("paper", particles=200, small_step=8)])
def test_it_follows_the_target(scene, film, config):
    tracker = patchlock.Tracker(film[0], scene.truth(0), config)
    assert tracker.estimate.box == pytest.approx(scene.truth(0)) and tracker.estimate.frame == 0
    for k, frame in enumerate(film[1:], 1):
        estimate = tracker.update(frame)
        assert overlap(estimate.box, scene.truth(k)) > 0.7
        assert estimate.frame == k
        assert estimate.ms > 0
        assert tracker.estimate == estimate and tracker.estimate.ms == estimate.ms


def test_an_estimate_has_all_fields(scene, film):
    estimate = patchlock.Tracker(film[0], scene.truth(0), preset="paper").estimate
    assert estimate.box == pytest.approx(scene.truth(0))
    assert estimate.box.w == estimate.box[2]
    assert estimate.corners.shape == (4, 2) and estimate.corners.dtype == np.float64
    assert np.all(estimate.corners[0] < estimate.corners[2])
    large, small = estimate.visibility
    assert (large.shape, small.shape, large.dtype) == ((3, 3), (13, 13), bool)
    assert estimate.visibility.shares == (large.mean(), small.mean())
    assert estimate.score == pytest.approx(sum(estimate.visibility.shares) / 2)
    assert estimate.status == "tracked"
    assert "box=(" in repr(estimate) and "status='tracked'" in repr(estimate)
    assert list(estimate.to_dict().values())[5] == estimate.score


def test_estimates_compare_and_pickle(scene, film):
    tracker = patchlock.Tracker(film[0], scene.truth(0), QUICK)
    first = tracker.estimate
    second = tracker.update(film[1])
    assert first != second
    for back in (pickle.loads(pickle.dumps(second)), copy.deepcopy(second)):
        assert back == second
        assert numbers(back) == numbers(second)
        assert (back.frame, back.ms) == (second.frame, second.ms)
    assert second.numbered(7) != second
    assert second.numbered(7).status == second.status


CORNERS = [[9.5, 19.5], [39.5, 19.5], [39.5, 59.5], [9.5, 59.5]]
MAPS = (np.array([[False, True], [True, True]]), np.ones((3, 3), bool))


@pytest.mark.parametrize("visibility", [None, MAPS])
@pytest.mark.parametrize("status", ["tracked", "uncertain", "lost"])
def test_pickling_keeps_every_field(visibility, status):
    """Score and status are stored: here neither follows from the visible share."""
    made = patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.123, status, visibility, frame=7, ms=2.5)
    for back in (made, pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert back == made
        assert (back.box, back.score, back.status, back.frame, back.ms) == (
            (10, 20, 30, 40),
            0.123,
            status,
            7,
            2.5,
        )
        assert back.corners.tolist() == CORNERS
        assert list(back.to_dict().items())[-1] == ("status", status)
        if visibility is None:
            assert back.visibility is None
            assert back.to_dict()["visible_large"] is None
        else:
            assert back.visibility.shares == (0.75, 1.0)
            assert all(np.array_equal(a, b) for a, b in zip(back.visibility, visibility, strict=True))


def test_estimates_differ_in_score_status_and_visibility():
    made = patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.5, "tracked")
    assert made == patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.5, "tracked", ms=9)
    assert made != patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.6, "tracked")
    assert made != patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.5, "lost")
    assert made != patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.5, "tracked", MAPS)


def test_invalid_estimates_are_refused():
    with pytest.raises(ValueError, match="status is 'gone'; allowed: tracked, uncertain, lost"):
        patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.5, "gone")
    with pytest.raises(ValueError, match="four corners"):
        patchlock.Estimate((10, 20, 30, 40), CORNERS[:3], 0.5, "tracked")
    with pytest.raises(TypeError, match="two boolean arrays"):
        patchlock.Estimate((10, 20, 30, 40), CORNERS, 0.5, "tracked", (np.zeros((2, 2)), MAPS[1]))


def test_boxes_depend_on_the_seed_but_not_on_threads(scene, film):
    box = scene.truth(0)
    one = follow(film, box, threads=1)
    assert follow(film, box, threads=3) == one
    assert follow(film, box) == one
    assert follow(film, box, config=configured("paper", **SETTINGS, seed=1)) != one


@pytest.mark.parametrize("again", [lambda t: pickle.loads(pickle.dumps(t)), copy.deepcopy, copy.copy])
@pytest.mark.parametrize("at", [1, 6])
def test_a_copy_gives_the_same_boxes(scene, film, again, at):
    tracker = patchlock.Tracker(film[0], scene.truth(0), QUICK, threads=2, channels="bgr")
    for frame in film[1:at]:
        tracker.update(frame)
    copied = again(tracker)
    assert (copied.threads, copied.channels, copied.config) == (2, "bgr", QUICK)
    assert copied.estimate == tracker.estimate
    for k, frame in enumerate(film[at:], at):
        ours, theirs = tracker.update(frame), copied.update(frame)
        assert numbers(ours) == numbers(theirs)
        assert ours.frame == theirs.frame == k


def test_a_snapshot_is_json_and_can_be_restored(scene, film):
    tracker = patchlock.Tracker(film[0], scene.truth(0), QUICK)
    snapshot = tracker.snapshot()
    version = json.loads(snapshot)["version"]
    restored = patchlock.Tracker.restore(snapshot)
    assert numbers(restored.update(film[1])) == numbers(tracker.update(film[1]))
    with pytest.raises(ValueError, match="not a snapshot of a Tracker"):
        patchlock.Tracker.restore(b"{}")
    with pytest.raises(ValueError, match="version is 1;"):
        patchlock.Tracker.restore(snapshot.replace(b'"version":%d' % version, b'"version":1'))


def test_a_restart_gives_the_boxes_of_a_new_tracker(scene, film):
    tracker = patchlock.Tracker(film[3], (40, 30, 36, 30), QUICK)
    tracker.update(film[4])
    found = [numbers(tracker.restart(film[0], scene.truth(0)))]
    assert tracker.estimate.frame == 0
    found += [numbers(tracker.update(frame)) for frame in film[1:]]
    assert found == follow(film, scene.truth(0))
    assert tracker.update(film[0]).frame == len(film)


# ---- arguments


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({"config": configured("paper", large_patch=64)}, ValueError, "at most template_side = 32"),
        ({"threads": 0}, ValueError, "1 to 1024"),
        ({"channels": "hsv"}, ValueError, "'rgb', 'bgr'"),
    ],
)
def test_wrong_arguments_are_refused(film, arguments: dict[str, Any], error, says):
    with pytest.raises(error, match=says):
        patchlock.Tracker(film[0], (70, 60, 40, 30), **arguments)


@pytest.mark.parametrize(
    ("box", "error", "says"),
    [
        ((1, 2, 3), ValueError, "four numbers x, y, w, h"),
        ("1,2,3,4", TypeError, "four numbers"),
        (5, TypeError, "four numbers"),
        ((0, 0, 0.5, 9), ValueError, "at least 1 pixel"),
        ((0, 0, float("nan"), 9), ValueError, "finite"),
        ((900, 0, 20, 20), ValueError, "outside the frame of 240x180"),
    ],
)
def test_wrong_boxes_are_refused(film, box, error, says):
    with pytest.raises(error, match=says):
        patchlock.Tracker(film[0], box)


@pytest.mark.parametrize(
    "box", [(70, 60, 40, 30), [70, 60, 40, 30], np.array([70, 60, 40, 30]), np.float32([70, 60, 40, 30])]
)
def test_a_box_is_any_four_numbers(film, box):
    assert patchlock.Tracker(film[0], box, QUICK).estimate.box == pytest.approx((70, 60, 40, 30))


def test_the_size_of_frames_is_checked(scene, film):
    tracker = patchlock.Tracker(film[0], scene.truth(0), QUICK)
    before = tracker.snapshot()
    with pytest.raises(ValueError, match="240x100 pixels, but tracking began on 240x180"):
        tracker.update(film[1][:100])
    with pytest.raises(ValueError, match="outside"):
        tracker.restart(film[1], (900, 0, 20, 20))
    assert tracker.snapshot() == before
    assert tracker.restart(film[1][:100], scene.truth(0)).frame == 0


# ---- threads and processes


def slow_tracker(film, box) -> patchlock.Tracker:
    return patchlock.Tracker(film[0], box, configured("paper", particles=4000), threads=1)


def test_other_threads_run_while_a_frame_is_tracked(scene, film):
    """If the call held the GIL, the counter would stop for its whole duration."""
    tracker = slow_tracker(film, scene.truth(0))
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
    within = [step for step in steps if begin < step < end]
    assert end - begin > 0.03, "the frame is slow enough to tell"
    assert len(within) >= 5


def test_trackers_run_side_by_side(scene, film):
    """Two calls overlap in time and give the same boxes as one alone."""
    box = scene.truth(0)
    alone = numbers(slow_tracker(film, box).update(film[1]))
    trackers = [slow_tracker(film, box) for _ in range(2)]
    ready = threading.Barrier(2)
    spans: list[tuple[float, float]] = []
    found = []

    def work(tracker: patchlock.Tracker) -> None:
        ready.wait()
        begin = time.perf_counter()
        estimate = tracker.update(film[1])
        spans.append((begin, time.perf_counter()))
        found.append(numbers(estimate))

    threads = [threading.Thread(target=work, args=(tracker,)) for tracker in trackers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (begin_a, end_a), (begin_b, end_b) = spans
    assert max(begin_a, begin_b) < min(end_a, end_b)
    assert found == [alone, alone]


def test_two_threads_on_one_tracker_take_turns(scene, film):
    tracker = slow_tracker(film, scene.truth(0))
    threads = [threading.Thread(target=tracker.update, args=(frame,)) for frame in film[1:4]]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert tracker.update(film[4]).frame == 4


def told(estimate: patchlock.Estimate) -> tuple[Any, ...]:
    """What every method says, exact to the last bit."""
    return (*estimate.box, *estimate.corners.ravel(), estimate.score, estimate.status)


def forked(tracker: patchlock.Tracker, frame: Any, answers: Any) -> None:
    answers.put(told(tracker.update(frame)))


def begun(method: str, frame: Any, box: Any, threads: int | None) -> patchlock.Tracker:
    """A tracker of a method, or of a network: the made-up one, or a real one by the name of its folder."""
    if method == "paper":
        return patchlock.Tracker(frame, box, QUICK, threads=threads)
    model = VITTRACK if method == "made-up" else outside("PATCHLOCK_MODELS", "models", method)
    return patchlock.Tracker(frame, box, preset="network", model=model, threads=threads)


NEEDS_FORK = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a system that forks")
# Python warns of what is tested here.
FORKS = pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
METHODS = pytest.mark.parametrize("method", ["paper", "made-up", "nanotrack-v3", "vittrack"])


@NEEDS_FORK
@FORKS
@METHODS
@pytest.mark.parametrize("threads", [None, 2])
def test_a_forked_process_continues_to_track(scene, film, threads, method):
    """The parent's threads do not exist in the child, which must make its own instead of waiting forever."""
    tracker = begun(method, film[0], scene.truth(0), threads)
    for frame in film[1:3]:
        tracker.update(frame)
    context = multiprocessing.get_context("fork")
    answers = context.Queue()
    child = context.Process(target=forked, args=(tracker, film[3], answers))
    child.start()
    answer = answers.get(timeout=60)
    child.join(timeout=60)
    assert child.exitcode == 0
    assert answer == told(tracker.update(film[3]))


@NEEDS_FORK
@FORKS
@pytest.mark.parametrize("method", ["made-up", "patchnet", "nanotrack-v3", "vittrack"])
def test_a_forked_process_loads_a_network(scene, film, method):
    """The runtime that has loaded one in the parent has threads that do not exist in the child, which loads it
    without optimising, so that the last digits may differ."""
    if method == "patchnet":
        model = Path(__file__).parents[2] / "patchlock/models"
    else:
        model = VITTRACK if method == "made-up" else outside("PATCHLOCK_MODELS", "models", method)

    def track() -> list[list[float]]:
        tracker = patchlock.Tracker(film[0], scene.truth(0), preset="network", model=patchlock.Network(model))
        return [list(tracker.update(frame).box) for frame in film[1:4]]

    expected = track()
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(write, json.dumps(track()).encode())
            os._exit(0)
        finally:
            os._exit(1)
    assert ended(child) == 0
    assert np.allclose(json.loads(os.read(read, 1 << 16)), expected, atol=1e-2)


@NEEDS_FORK
@FORKS
@METHODS
def test_a_process_that_is_forked_while_another_thread_tracks_continues(scene, film, method):
    """What the other thread holds at that moment would stay locked in the child."""
    tracker = begun(method, film[0], scene.truth(0), 2)
    stop = threading.Event()

    def track() -> None:
        while not stop.is_set():
            tracker.update(film[1])

    threads = [threading.Thread(target=track) for _ in range(2)]
    for thread in threads:
        thread.start()
    try:
        for _ in range(8):
            child = os.fork()
            if child == 0:
                try:
                    tracker.update(film[2])
                    repr(tracker)
                    os._exit(0)
                finally:
                    os._exit(1)
            assert ended(child) == 0
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    frame = tracker.estimate.frame
    assert tracker.update(film[3]).frame == frame + 1, "the parent continues, too"


def ended(child: int) -> int:
    """The exit code of a process, which is killed after a minute."""
    for _ in range(6000):
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return -1


@NEEDS_FORK
@FORKS
def test_frames_that_were_opened_before_a_fork_are_refused_after_it(film, tmp_path):
    for k, frame in enumerate(film[:2]):
        Image.fromarray(frame).save(tmp_path / f"{k}.png")
    frames = patchlock.Frames(tmp_path)
    child = os.fork()
    if child == 0:
        try:
            next(frames)
        except RuntimeError as error:
            os._exit(0 if "open them again" in str(error) else 1)
        finally:
            os._exit(2)
    assert ended(child) == 0
    assert len(list(frames)) == 2
