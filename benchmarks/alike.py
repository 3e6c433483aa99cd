#!/usr/bin/env python3
"""How often the tracker calls another animal of the same looks "tracked".

    tools/python/setup.sh
    target/python-venv/bin/python benchmarks/alike.py

Four dark ellipses walk and turn at random on a light floor, and pass over each other. One of them is tracked over
180 frames, in six scenes of each size. The smaller the scene, the more often they meet. A box is on the target if
its overlap is at least .5, and off below .1.
"""

import math

import numpy as np
import patchlock

FRAMES, SEEDS = 180, 6
SIZES = ((320, 240), (240, 180))
LENGTH, BREADTH = 18, 9  # half of an animal
STEP = 2.0


class Herd:
    """Animals that walk and turn at random."""

    def __init__(self, seed: int, size: tuple[int, int]) -> None:
        self.rng, self.size = np.random.default_rng(seed), np.array(size)
        self.places = self.rng.uniform([40, 40], self.size - 40, (4, 2))
        self.headings = self.rng.uniform(0, 2 * math.pi, 4)
        width, height = size
        self.floor = 190 + self.rng.normal(0, 6, (height, width, 1)) + self.rng.normal(0, 2, (height, width, 3))
        self.y, self.x = np.mgrid[:height, :width]

    def frame(self) -> np.ndarray:
        pixels = self.floor + self.rng.normal(0, 3, self.floor.shape)
        for (x, y), heading in zip(self.places, self.headings, strict=True):
            cos, sin = math.cos(heading), math.sin(heading)
            along = ((self.x - x) * cos + (self.y - y) * sin) / LENGTH
            across = ((self.y - y) * cos - (self.x - x) * sin) / BREADTH
            cover = np.clip((1.05 - np.hypot(along, across)) * 9, 0, 1)[..., None]
            pixels = pixels * (1 - cover) + cover * (45 + 15 * np.clip(along, -1, 1)[..., None])
        return np.clip(pixels, 0, 255).astype(np.uint8)

    def box(self) -> patchlock.Box:
        """Around the first animal."""
        (x, y), heading = self.places[0], self.headings[0]
        cos, sin = math.cos(heading), math.sin(heading)
        w, h = math.hypot(LENGTH * cos, BREADTH * sin), math.hypot(LENGTH * sin, BREADTH * cos)
        return patchlock.Box(x - w, y - h, 2 * w, 2 * h)

    def walk(self) -> None:
        self.headings += self.rng.normal(0, 0.08, 4)
        self.places += STEP * np.stack([np.cos(self.headings), np.sin(self.headings)], axis=1)
        for animal, place in enumerate(self.places):
            if (np.minimum(place, self.size - place) < 25).any():
                x, y = self.size / 2 - place
                self.headings[animal] = math.atan2(y, x)


def counts(size: tuple[int, int], model: str) -> list[int]:
    """Frames, frames on the target, frames called tracked, and those of them that are off."""
    found = np.zeros(4, int)
    for seed in range(SEEDS):
        herd = Herd(seed, size)
        tracker = patchlock.Tracker(herd.frame(), herd.box(), model=model)
        for _ in range(1, FRAMES):
            herd.walk()
            estimate = tracker.update(herd.frame())
            overlap, tracked = estimate.box.iou(herd.box()), estimate.status == "tracked"
            found += [1, overlap >= 0.5, tracked, tracked and overlap < 0.1]
    return found.tolist()


def main() -> None:
    print("| scene | network | frames | on | tracked | tracked, off |\n|" + " --- |" * 6)
    for width, height in SIZES:
        for model in ("patchnet", "none"):
            words = map(str, counts((width, height), model))
            print(f"| {width} x {height} | {model} | {' | '.join(words)} |", flush=True)


if __name__ == "__main__":
    main()
