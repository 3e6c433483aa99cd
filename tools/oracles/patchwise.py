"""Turns images into joint sparse coding problems, with the tracker's conventions.

Covers states, warps, templates, patches and dictionaries. All input of a solver is rounded to f32 and stored
as f64, so that all solvers receive exactly the same numbers.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

import warp
from golden import as_f32

SIDE = 32
BUFFER = 4
# The first templates: the box and nine shifts of it, as x, y in pixels.
SHIFTS = [(0, 0), (2, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)]
# Motion sigma of (x, y, s, theta, r, phi).
SIGMA = np.array([6.0, 6.0, 0.02, 0.002, 0.002, 0.0])


@dataclass(frozen=True)
class Scale:
    """Square patches of one size, cut at every `step` pixels; locations are numbered row by row."""

    name: str
    size: int
    step: int

    @property
    def per_row(self) -> int:
        return (SIDE - self.size) // self.step + 1

    @property
    def locations(self) -> int:
        return self.per_row**2


SMALL = Scale("small", 8, 2)
LARGE = Scale("large", 16, 8)
SCALES = {s.name: s for s in (SMALL, LARGE)}


@dataclass(frozen=True)
class Sequence:
    """Frames on disk and their boxes (x, y, w, h), 1-based; (x, y) is the first pixel of the box."""

    name: str
    frames: list[Path]
    boxes: np.ndarray

    def grey(self, index: int) -> np.ndarray:
        return grey(cv2.imread(str(self.frames[index]), cv2.IMREAD_COLOR))

    def state(self, index: int) -> np.ndarray:
        x, y, w, h = self.boxes[index]
        return np.array([x - 1 + (w - 1) / 2, y - 1 + (h - 1) / 2, w / SIDE, 0.0, h / w, 0.0])


def read_sequence(folder: Path) -> Sequence:
    """Reads the OTB layout: img/* sorted by name; groundtruth_rect.txt with commas, tabs or spaces."""
    text = (folder / "groundtruth_rect.txt").read_text().replace(",", " ")
    boxes = np.array([[float(v) for v in line.split()] for line in text.splitlines() if line.strip()])
    frames = sorted(p for p in (folder / "img").iterdir() if p.suffix in {".jpg", ".png", ".ppm"})
    return Sequence(folder.name, frames[: len(boxes)], boxes)


def grey(bgr: np.ndarray) -> np.ndarray:
    b, g, r = np.moveaxis(bgr.astype(np.float64), -1, 0)
    return as_f32((0.2989 * r + 0.5870 * g + 0.1140 * b) / 255)


def normalised(columns: np.ndarray) -> np.ndarray:
    """Columns of unit length, rounded to f32; a zero column stays zero."""
    norms = np.linalg.norm(columns, axis=0)
    return as_f32(columns / np.where(norms > 0, norms, 1.0))


def candidate(image: np.ndarray, state: np.ndarray) -> np.ndarray:
    """The warped and normalised candidate, 1024 values row by row."""
    return normalised(warp.by_scipy(image, warp.matrix(tuple(state))).reshape(-1, 1))[:, 0]


def first_templates(image: np.ndarray, state: np.ndarray) -> np.ndarray:
    return np.array([candidate(image, state + np.array([dx, dy, 0, 0, 0, 0])) for dx, dy in SHIFTS])


def patches(template: np.ndarray, scale: Scale) -> np.ndarray:
    """One normalised column per location."""
    image = template.reshape(SIDE, SIDE)
    corners = [
        (scale.step * row, scale.step * column) for row, column in np.ndindex(scale.per_row, scale.per_row)
    ]
    return normalised(
        np.stack([image[y : y + scale.size, x : x + scale.size].ravel() for y, x in corners], axis=1)
    )


def dictionary(templates: np.ndarray, scale: Scale) -> np.ndarray:
    """Atom j*L + l is location l of template j."""
    return np.asfortranarray(np.hstack([patches(t, scale) for t in templates]))


@dataclass(frozen=True)
class Setting:
    """Templates, buffer and candidates (rows of 1024 values), from which the problems of a frame are made."""

    name: str
    templates: np.ndarray
    buffer: np.ndarray
    candidates: np.ndarray

    def signals(self, scale: Scale, which: int, location: int) -> np.ndarray:
        """The candidate's patch and the buffer's patches of the same location: five columns."""
        images = [self.candidates[which], *self.buffer]
        return np.stack([patches(i, scale)[:, location] for i in images], axis=1)


def perturbed(rng: np.random.Generator, state: np.ndarray) -> np.ndarray:
    return state + SIGMA * rng.normal(size=6)


def setting(rng: np.random.Generator, sequence: Sequence, candidates: int, tracked: bool) -> Setting:
    """Samples templates, buffer and candidates from a sequence.

    The templates are those of frame 0. The buffer consists of the last templates or, if `tracked`, of the
    true boxes of four later frames. Each candidate is in a random frame: every third one is close to the
    truth, the others are spread by the motion model.
    """
    templates = first_templates(sequence.grey(0), sequence.state(0))
    last = len(sequence.frames) - 1
    buffer_frames = [max(1, last * k // 10) for k in range(1, BUFFER + 1)]
    buffer = templates[-BUFFER:]
    if tracked:
        buffer = np.array([candidate(sequence.grey(f), sequence.state(f)) for f in buffer_frames])
    images = []
    for k in range(candidates):
        frame = int(rng.integers(buffer_frames[-1] if tracked else 1, last + 1))
        offset = perturbed(rng, np.zeros(6)) * (0.15 if k % 3 == 0 else 1.0)
        images.append(candidate(sequence.grey(frame), sequence.state(frame) + offset))
    return Setting(
        f"{sequence.name}, {'tracked' if tracked else 'first'} buffer", templates, buffer, np.array(images)
    )
