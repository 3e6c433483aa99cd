"""Tests of what is made from an estimate: coordinates, drawings, detections."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import patchlock

CORNERS = [[19.5, 29.5], [49.5, 29.5], [49.5, 69.5], [19.5, 69.5]]
BOX = (20, 30, 30, 40)


def estimate(status="tracked", score=0.9) -> patchlock.Estimate:
    return patchlock.Estimate(BOX, CORNERS, score, status)


def test_a_box_has_the_usual_coordinates():
    box = patchlock.Box(20, 30, 30.5, 40)
    assert box.xywh == (20, 30, 30.5, 40)
    assert box.xyxy == (20, 30, 50.5, 70)


def test_a_drawing_is_a_copy_with_lines_and_score():
    frame = np.full((100, 120, 3), 60, np.uint8)
    before = frame.copy()
    drawn = estimate().draw(frame)
    assert np.array_equal(frame, before)
    assert drawn.shape == frame.shape and drawn.dtype == np.uint8
    changed = (drawn != frame).any(axis=2)
    assert changed[30, 25:45].all() and changed[40:60, 20].all(), "the edges of the box"
    assert not changed[45:55, 30:40].any(), "inside of it"
    assert not changed[80:].any() and not changed[:, 100:].any(), "far from it"
    assert changed[15:26, 22:40].any(), "the score above it"


def test_status_and_score_change_the_drawing():
    frame = np.zeros((100, 120, 3), np.uint8)
    drawings = [estimate("tracked"), estimate("tracked", 0.1), estimate("uncertain"), estimate("lost")]
    pictures = {one.draw(frame).tobytes() for one in drawings}
    assert len(pictures) == 4


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_every_kind_of_frame_can_be_drawn_on(kind):
    scale = {np.uint8: 1, np.uint16: 256, np.float32: 1 / 255}[kind]
    colour = np.arange(100 * 120 * 3).reshape(100, 120, 3) % 200
    frame = (colour * scale).astype(kind)
    expected = estimate().draw(colour.astype(np.uint8))
    assert np.array_equal(estimate().draw(frame), expected)
    assert np.array_equal(estimate().draw(frame[..., ::-1], channels="bgr"), expected[..., ::-1])
    assert np.array_equal(estimate().draw(np.pad(frame, [(5, 5), (3, 3), (0, 0)])[5:-5, 3:-3]), expected)
    grey = estimate().draw(frame[..., 0])
    assert np.array_equal(grey[90:], np.repeat(colour[90:, :, :1], 3, axis=2))


def test_frames_that_are_none_are_refused():
    with pytest.raises(TypeError, match="a frame is a numpy array"):
        estimate().draw("frame")
    with pytest.raises(ValueError, match="shape"):
        estimate().draw(np.zeros((2, 2, 2, 2), np.uint8))
    with pytest.raises(ValueError):
        estimate().draw(np.zeros((0, 0), np.uint8))
    with pytest.raises(ValueError, match="'rgb', 'bgr'"):
        estimate().draw(np.zeros((9, 9), np.uint8), channels="hsv")


def test_supervision_gets_detections():
    sv = pytest.importorskip("supervision", reason="needs the extra supervision")
    found = patchlock.to_supervision({4: estimate(), 5: estimate("lost"), 7: estimate("uncertain", 0.25)})
    assert found.xyxy.tolist() == [[20, 30, 50, 70]] * 2
    assert found.confidence.tolist() == [0.9, 0.25]
    assert found.tracker_id.tolist() == [4, 7]
    assert found.data["status"].tolist() == ["tracked", "uncertain"]
    frame = np.zeros((100, 120, 3), np.uint8)
    assert sv.BoxAnnotator().annotate(frame.copy(), found).any()
    assert sv.OrientedBoxAnnotator().annotate(frame.copy(), found).any()
    assert patchlock.to_supervision(estimate()).tracker_id.tolist() == [1]
    assert len(patchlock.to_supervision({})) == len(patchlock.to_supervision(estimate("lost"))) == 0


def test_without_supervision_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "supervision", None)
    with pytest.raises(ImportError, match=r"pip install \"patchlock\[supervision\]\""):
        patchlock.to_supervision({})


def test_the_time_does_not_matter_for_equality():
    one, other = (patchlock.Estimate(BOX, CORNERS, 0.5, "tracked", ms=ms) for ms in (1, 2))
    assert one == other


def test_a_star_import_does_not_hide_other_packages():
    names: dict[str, object] = {}
    exec("from patchlock import *", names)
    assert "rerun" not in names and names["Tracker"] is patchlock.Tracker
