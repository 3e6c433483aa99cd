"""Tests of Box: made of any four numbers, measured against another one."""

from __future__ import annotations

import numpy as np
import pytest

from patchlock import Box


@pytest.mark.parametrize(
    "kind",
    [
        list,
        tuple,
        iter,
        np.array,
        lambda numbers: np.array(numbers, np.float32),
        lambda numbers: np.array([numbers, numbers])[1],
        lambda numbers: [np.int64(number) for number in numbers],
        lambda numbers: Box(*numbers),
    ],
)
def test_a_box_is_made_of_any_four_numbers(kind):
    box = Box.from_xywh(kind([30, 20, 40, 32]))
    assert box == (30, 20, 40, 32) and repr(box) == "Box(x=30.0, y=20.0, w=40.0, h=32.0)"
    assert Box.from_xyxy(kind([30, 20, 70, 52])) == box
    assert box.iou(kind([30, 20, 40, 32])) == 1


def test_corners_and_sides_are_each_others_inverse():
    box = Box(3.25, -1.5, 7.5, 1.0)
    assert box.xyxy == (3.25, -1.5, 10.75, -0.5)
    assert Box.from_xyxy(box.xyxy) == box == Box.from_xywh(box.xywh)


def test_overlap_of_known_boxes():
    box = Box(0, 0, 10, 10)
    assert box.iou((5, 0, 10, 10)) == pytest.approx(1 / 3)
    assert box.iou((0, 5, 20, 5)) == pytest.approx(50 / 150)
    assert box.iou((10, 0, 10, 10)) == 0 and box.iou((20, 20, 1, 1)) == 0


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda: Box.from_xywh(3), TypeError, "four numbers x, y, w, h: .*; not 3"),
        (lambda: Box.from_xywh([1, 2, 3]), ValueError, r"four numbers x, y, w, h: .*; not \[1, 2, 3\]"),
        (lambda: Box.from_xyxy("abcd"), TypeError, "four numbers x1, y1, x2, y2: .*; not 'abcd'"),
        (lambda: Box.from_xyxy(np.zeros((2, 4))), TypeError, "four numbers x1, y1, x2, y2"),
        (lambda: Box.from_xyxy([9, 1, 3, 4]), ValueError, "from x 9 to 3 and from y 1 to 4 ends before"),
        (lambda: Box.from_xyxy([1, 9, 3, 4]), ValueError, "from y 9 to 4 ends before"),
        (lambda: Box(1, 2, 3, 4).iou([1, 2]), ValueError, r"not \[1, 2\]"),
    ],
)
def test_errors_name_what_is_no_box(make, error, says):
    with pytest.raises(error, match=says):
        make()
