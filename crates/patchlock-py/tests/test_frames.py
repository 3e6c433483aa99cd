"""Tests of frame arrays and images: layouts, types and channel orders, and invalid frames."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from conftest import QUICK, follow
from PIL import Image

import patchlock


@pytest.fixture(scope="module")
def expected(scene, film):
    return follow(film, scene.truth(0))


def wide(frame):
    """The frame as a crop of a larger array, so that there is padding between its rows."""
    large = np.zeros((frame.shape[0] + 9, frame.shape[1] + 21, *frame.shape[2:]), frame.dtype)
    part = large[4:-5, 10:-11]
    part[...] = frame
    return part


def crop_of_bytes(whole):
    """A crop of an array whose memory is unaligned bytes."""
    return np.frombuffer(b"?" + whole.tobytes(), np.uint8, offset=1).reshape(whole.shape)[4:-5, 10:-11]


@pytest.mark.parametrize(
    "change",
    [
        np.asfortranarray,
        wide,
        lambda frame: np.concatenate([frame, frame[..., :1]], axis=2)[..., :3],
        lambda frame: np.repeat(frame, 2, axis=1)[:, ::2],
        lambda frame: np.ascontiguousarray(frame[::-1])[::-1],
        lambda frame: np.ascontiguousarray(frame[:, ::-1])[:, ::-1],
        lambda frame: np.ascontiguousarray(frame[..., ::-1])[..., ::-1],
        lambda frame: wide(np.ascontiguousarray(frame[..., ::-1]))[..., ::-1],
        lambda frame: np.ascontiguousarray(frame.transpose(2, 0, 1)).transpose(1, 2, 0),
        lambda frame: np.frombuffer(frame.tobytes(), np.uint8).reshape(frame.shape),
        lambda frame: crop_of_bytes(wide(frame).base),
        Image.fromarray,
    ],
    ids=[
        "fortran", "crop", "alpha cut off", "every other pixel", "upside down", "mirrored", "reversed",
        "crop reversed", "channels first", "bytes", "crop of bytes", "PIL",
    ],
)  # fmt: skip
def test_layouts_do_not_matter(scene, film, expected, change):
    assert follow([change(frame) for frame in film], scene.truth(0)) == expected


@pytest.mark.parametrize("layout", [np.ascontiguousarray, wide, lambda frame: frame])
def test_bgr_arrays_give_the_same_boxes(scene, film, expected, layout):
    bgr = [layout(frame[..., ::-1]) for frame in film]
    assert follow(bgr, scene.truth(0), channels="bgr") == expected
    assert follow(bgr, scene.truth(0)) != expected
    images = [Image.fromarray(frame) for frame in film]
    assert follow(images, scene.truth(0), channels="bgr") == expected, (
        "an image knows its colours"
    )


def test_grey_in_every_depth(scene, film):
    grey = [np.asarray(Image.fromarray(frame).convert("L")) for frame in film]
    box = scene.truth(0)
    expected = follow(grey, box)

    def same(frames, **settings) -> bool:
        return follow(frames, box, **settings) == expected

    assert same([frame[..., None] for frame in grey])
    assert same([wide(frame) for frame in grey])
    assert same([np.asfortranarray(frame) for frame in grey])
    assert same([Image.fromarray(frame) for frame in grey])
    assert same(grey, channels="bgr")
    assert same([(frame / np.float32(255)).astype(np.float32) for frame in grey])
    deep = follow([frame.astype(np.uint16) * 257 for frame in grey], box)
    np.testing.assert_allclose([row[:4] for row in deep], [row[:4] for row in expected], atol=1e-2)
    assert same([Image.fromarray(frame / np.float32(255)) for frame in grey]), "an image of mode F"


def test_colour_in_every_depth(scene, film, expected):
    box = scene.truth(0)
    for frames in ([f.astype(np.uint16) * 257 for f in film], [f / np.float32(255) for f in film]):
        found = follow(frames, box)
        np.testing.assert_allclose([row[:4] for row in found], [row[:4] for row in expected], atol=1e-2)


@pytest.mark.parametrize("mode", ["P", "RGBA", "1", "LA", "CMYK", "I;16"])
def test_images_of_every_mode_are_accepted(scene, film, mode):
    image = (
        Image.fromarray(np.zeros((180, 240), np.uint16))
        if mode == "I;16"
        else Image.fromarray(film[0]).convert(mode)
    )
    assert image.mode == mode
    patchlock.Tracker(image, scene.truth(0), QUICK)


@pytest.mark.parametrize("part", [slice(None), np.s_[100:1000, 200:1800], np.s_[..., ::-1]])
def test_large_frames_are_not_copied(part):
    frame = np.random.default_rng(0).integers(0, 255, (1080, 1920, 3), np.uint8)[part]
    tracker = patchlock.Tracker(frame, (300, 300, 60, 60), QUICK)
    tracemalloc.start()
    tracker.update(frame)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100_000, "numpy reports its allocations: a copy would be millions of bytes"


@pytest.mark.parametrize(
    ("frame", "error", "says"),
    [
        (np.zeros((9, 9)), TypeError, "type float64; convert samples"),
        (np.zeros((9, 9), bool), TypeError, "type bool"),
        (np.zeros((9, 9), ">u2"), TypeError, "type >u2"),
        (np.zeros((9, 9), np.int32), TypeError, "uint8, uint16 or float32"),
        ([[1, 2], [3, 4]], TypeError, "a PIL image; this is list"),
        (None, TypeError, "this is NoneType"),
        (np.zeros(9, np.uint8), ValueError, r"shape \(9,\)"),
        (np.zeros((9, 9, 4), np.uint8), ValueError, r"shape \(9, 9, 4\); drop the fourth channel"),
        (np.zeros((3, 9, 9), np.uint8), ValueError, "move the channels to the end"),
        (np.zeros((2, 9, 9, 3), np.uint8), ValueError, "one frame at a time"),
        (np.zeros((9, 9, 2), np.uint8), ValueError, r"\(height, width, 3\)"),
        (np.zeros((0, 9), np.uint8), ValueError, "both sides must be at least 1"),
        (np.full((9, 9), np.nan, np.float32), ValueError, "x 0, y 0 is NaN"),
        (np.full((9, 9), 200, np.float32), ValueError, "black at 0 and white at 1"),
        (np.zeros((9, 9)), TypeError, "divide them by their white"),
        (Image.fromarray(np.zeros((9, 9), np.int32)), ValueError, "mode I"),
    ],
)
def test_invalid_frames_are_refused(frame, error, says):
    with pytest.raises(error, match=says):
        patchlock.Tracker(frame, (1, 1, 5, 5))


def test_a_file_with_too_many_pixels_is_refused(tmp_path):
    Image.new("RGB", (60, 50)).save(tmp_path / "0.png")
    with pytest.raises(OSError, match="60 x 50 pixels are more than the 2999 that are accepted"):
        next(patchlock.Frames(tmp_path, max_pixels=2999))
    number, frame = next(patchlock.Frames(tmp_path, max_pixels=3000))
    assert (number, frame.shape) == (0, (50, 60, 3))
