"""Windows, boxes and their maps.

Coordinates are continuous: pixel `i` covers `i` to `i + 1`. OpenCV counts from the middle of the
first pixel, so its maps are shifted by half a pixel.
"""

import cv2
import numpy as np

TEMPLATE = 64
SEARCH = 128
STRIDE = 8
CELLS = SEARCH // STRIDE
MIDDLE = SEARCH / 2


def context_side(width, height):
    """The side of the square with the target and its context: SiamFC's, half the perimeter / 2."""
    margin = (width + height) / 2
    return np.sqrt((width + margin) * (height + margin))


def linear(scale, rotation, aspect, shear):
    """A scale and rotation of a stretched and sheared plane."""
    cos, sin = np.cos(rotation), np.sin(rotation)
    stretch = np.sqrt(aspect)
    turn = np.array([[cos, -sin], [sin, cos]])
    return scale * turn @ np.array([[stretch, shear], [0, 1 / stretch]])


def box_of(points):
    """The box around points: left, top, right, bottom."""
    return np.concatenate([points.min(0), points.max(0)])


def inner(matrix, source, target):
    """The map of OpenCV that takes `source` to `target`, both continuous."""
    shift = np.asarray(target) - matrix @ np.asarray(source)
    return np.column_stack([matrix, matrix @ [0.5, 0.5] + shift - 0.5])


def window(image, centre, side, pixels, border):
    """A square window, sampled as the tracker does it: bilinear, without averaging."""
    scale = pixels / side
    matrix = inner(np.diag([scale, scale]), centre, [pixels / 2] * 2)
    return cv2.warpAffine(
        image,
        matrix,
        (pixels, pixels),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=tuple(float(value) for value in border),
    )


def overlap(a, b):
    """Intersection over union of two boxes."""
    sides = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
    shared = np.prod(np.maximum(sides, 0))
    return shared / (np.prod(a[2:] - a[:2]) + np.prod(b[2:] - b[:2]) - shared + 1e-9)


class Bend:
    """A smooth random shift of each point of a square, as of something that is not stiff."""

    def __init__(self, rng, strength, pixels=SEARCH, knots=5):
        coarse = rng.normal(0, strength, (knots, knots, 2)).astype(np.float32)
        self.shift = cv2.resize(coarse, (pixels, pixels), interpolation=cv2.INTER_CUBIC)

    def image(self, image):
        """The bent picture: each pixel shows what lies at it plus the shift."""
        pixels = self.shift.shape[0]
        at = np.arange(pixels, dtype=np.float32)
        columns = self.shift[..., 0] + at[None]
        rows = self.shift[..., 1] + at[:, None]
        return cv2.remap(image, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)

    def points(self, points):
        """Where points of the picture lie in the bent one."""
        bent = points.copy()
        last = self.shift.shape[0] - 1
        for _ in range(4):
            column, row = np.clip(np.rint(bent - 0.5), 0, last).astype(int).T
            bent = points - self.shift[row, column]
        return bent.astype(np.float32)
