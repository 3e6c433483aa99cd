"""Recordings for the rerun viewer, read back from the file."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import QUICK
from networks import VITTRACK

import patchlock

ONE = {
    "frame",
    "frame/box",
    "frame/outline",
    "score",
    "visible/large",
    "visible/small",
    "patches/large",
    "patches/small",
}
INSIDE = {"frame/particles", "candidate", "templates"}


class Recording:
    """A recording to a file, and its content."""

    def __init__(self, path: Path) -> None:
        self.rr = pytest.importorskip("rerun", reason="needs the extra rerun")
        self.path = path
        self.stream = self.rr.RecordingStream("patchlock-test")
        self.stream.save(str(path))

    def chunks(self) -> list[Any]:
        self.stream.flush()
        self.stream.disconnect()
        return [
            chunk
            for chunk in self.rr.chunk.RrdReader(str(self.path)).stream()
            if chunk.entity_path.startswith("/patchlock/")
        ]


def rows(chunks: list[Any]) -> Counter[str]:
    """How many times each entity was logged."""
    counts: Counter[str] = Counter()
    for chunk in chunks:
        counts[chunk.entity_path.removeprefix("/patchlock/")] += chunk.num_rows
    return counts


def column(chunks: list[Any], entity: str, name: str) -> dict[int, Any]:
    """A column of an entity, by frame."""
    found = {}
    for chunk in chunks:
        if chunk.entity_path == f"/patchlock/{entity}":
            batch = chunk.to_record_batch()
            found.update(zip(batch["frame"].to_pylist(), batch[name].to_pylist(), strict=True))
    return found


def test_one_target_with_its_observations(scene, film, tmp_path):
    recording = Recording(tmp_path / "a.rrd")
    tracker = patchlock.Tracker(film[0], scene.truth(0), QUICK)
    patchlock.rerun.log(tracker.estimate, film[0], recording=recording.stream)
    estimates = {}
    for frame in film[1:]:
        estimate, seen = tracker.update_observed(frame)
        estimates[estimate.frame] = estimate, seen
        patchlock.rerun.log(estimate, frame, seen, recording=recording.stream)
    chunks = recording.chunks()
    # A template is replaced on frames 5 and 10.
    assert rows(chunks) == {**dict.fromkeys(ONE, 12), **dict.fromkeys(INSIDE, 11), "mask": 2}
    scores = column(chunks, "score", "Scalars:scalars")
    assert list(scores) == list(range(12))
    particles = column(chunks, "frame/particles", "Points2D:positions")
    for k, (estimate, seen) in estimates.items():
        assert scores[k] == [estimate.score]
        np.testing.assert_allclose(particles[k], seen.particles[:, :2] + 0.5, rtol=1e-6)
    height, width, _ = film[0].shape
    image = column(chunks, "frame", "Image:buffer")[3]
    np.testing.assert_array_equal(np.array(image[0], np.uint8).reshape(height, width, 3), film[3])


def test_the_responses_of_robust(scene, film, tmp_path):
    recording = Recording(tmp_path / "a.rrd")
    tracker = patchlock.Tracker(film[0], scene.truth(0), model="none")
    seen = None
    for frame in film[1:4]:
        estimate, seen = tracker.update_observed(frame)
        patchlock.rerun.log(estimate, observation=seen, recording=recording.stream)
    chunks = recording.chunks()
    assert rows(chunks) == dict.fromkeys(ONE - {"frame"} | {"certainty", "tracking_filter", "memory"}, 3)
    assert column(chunks, "certainty", "Scalars:scalars")[3] == [seen.certainty]
    shown = np.array(column(chunks, "tracking_filter", "Image:buffer")[3][0], np.uint8)
    assert shown.argmax() == np.fft.fftshift(seen.tracking_filter).argmax()


def test_the_cells_of_a_network(film, tmp_path):
    recording = Recording(tmp_path / "a.rrd")
    tracker = patchlock.Tracker(film[0], (70, 60, 40, 30), preset="network", model=VITTRACK)
    seen = None
    for frame in film[1:4]:
        estimate, seen = tracker.update_observed(frame)
        patchlock.rerun.log(estimate, observation=seen, recording=recording.stream)
    chunks = recording.chunks()
    entities = ["frame/box", "frame/outline", "frame/seen", "score", "cells"]
    assert rows(chunks) == dict.fromkeys(entities, 3)
    shown = np.array(column(chunks, "cells", "Image:buffer")[3][0], np.uint8)
    np.testing.assert_array_equal(shown.reshape(seen.scores.shape), (255 * seen.scores).astype(np.uint8))


def test_the_members_of_a_committee(film, tmp_path):
    recording = Recording(tmp_path / "a.rrd")
    tracker = patchlock.Tracker(film[0], (70, 60, 40, 30), model=VITTRACK)
    estimate, seen = tracker.update_observed(film[1])
    patchlock.rerun.log(estimate, observation=seen, recording=recording.stream)
    chunks = recording.chunks()
    members = ["frame/filters", "frame/network", "frame/seen", "network/cells"]
    members += [f"filters/{name}" for name in ("certainty", "tracking_filter", "memory")]
    assert set(members) < set(rows(chunks))
    certainty = seen.observations["filters"].certainty
    assert column(chunks, "filters/certainty", "Scalars:scalars")[1] == [certainty]


def test_ids_of_many_targets_are_appended_to_the_names(scene, film, tmp_path):
    recording = Recording(tmp_path / "a.rrd")
    tracker = patchlock.MultiTracker(config=QUICK)
    tracker.add(film[0], scene.truth(0))
    tracker.add(film[0], (40, 30, 36, 30))
    for frame in film[1:4]:
        patchlock.rerun.log(
            tracker.update(frame), frame[..., ::-1], channels="bgr", recording=recording.stream
        )
    patchlock.rerun.log({}, film[4], recording=recording.stream)
    chunks = recording.chunks()
    entities = {"frame"} | {f"{name}/{i}" for name in ONE - {"frame"} for i in (1, 2)}
    assert rows(chunks) == dict.fromkeys(entities, 3)
    image = column(chunks, "frame", "Image:buffer")[2]
    assert bytes(image[0]) == film[2].tobytes()


def test_unknown_visibility_is_left_out(tmp_path):
    recording = Recording(tmp_path / "a.rrd")
    corners = [[9.5, 19.5], [39.5, 19.5], [39.5, 59.5], [9.5, 59.5]]
    estimate = patchlock.Estimate((10, 20, 30, 40), corners, 0.5, "tracked", frame=3)
    patchlock.rerun.log(estimate, recording=recording.stream)
    assert rows(recording.chunks()) == dict.fromkeys(["frame/box", "frame/outline", "score"], 1)


def test_the_status_is_in_the_label_and_the_colour(tmp_path):
    recording = Recording(tmp_path / "a.rrd")
    corners = [[9.5, 19.5], [39.5, 19.5], [39.5, 59.5], [9.5, 59.5]]
    for k, status in enumerate(["tracked", "uncertain", "lost"]):
        estimate = patchlock.Estimate((10, 20, 30, 40), corners, 0.5, status, frame=k)
        patchlock.rerun.log(estimate, recording=recording.stream)
    chunks = recording.chunks()
    labels = column(chunks, "frame/box", "Boxes2D:labels")
    assert labels == {0: ["0.50"], 1: ["0.50 uncertain"], 2: ["0.50 lost"]}
    colours = column(chunks, "frame/outline", "LineStrips2D:colors")
    assert len({str(colours[k]) for k in range(3)}) == 3


def test_inconsistent_arguments_are_refused(scene, film, monkeypatch):
    tracker = patchlock.Tracker(film[0], scene.truth(0), QUICK)
    first = tracker.estimate
    second, seen = tracker.update_observed(film[1])
    with pytest.raises(TypeError, match="belongs to one target"):
        patchlock.rerun.log({1: second}, film[1], seen)
    with pytest.raises(ValueError, match=r"different frames: \[0, 1\]"):
        patchlock.rerun.log({1: first, 2: second})
    # None in sys.modules makes the import fail, as if the package were not installed.
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(ImportError, match=r'pip install rerun-sdk'):
        patchlock.rerun.log(first)
