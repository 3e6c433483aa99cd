#!/usr/bin/env python3
"""The annotator's bill with OpenCV's CSRT: key frames per 100 frames until every frame has a good box.

    pip install -r benchmarks/peers-requirements.txt
    python3 benchmarks/annotator_csrt.py OTB MINE

What `cargo run --release -p patchlock-cli --example annotator` asks of Patchlock, asked of a tool with a
forward tracker: the person starts CSRT on the first frame, corrects the first frame whose overlap with
the truth is below 0.5, and so on to the end. While the mean overlap is then below 0.8, the person also
corrects the frame with the smallest overlap, from which CSRT goes on to the next key frame. Datasets are in
the layout of OTB. CSRT is deterministic.
"""

import re
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import cv2

MEAN, LEAST = 0.8, 0.5
Box = tuple[float, float, float, float]


def truth(file: Path) -> list[Box | None]:
    """Boxes counted from 0; `None` where the numbers are no box."""
    rows: list[Box | None] = []
    for line in file.read_text().splitlines():
        x, y, w, h = (float(word) for word in re.split(r"[,\s]+", line.strip()))
        rows.append((x - 1, y - 1, w, h) if w > 0 and h > 0 else None)
    return rows


def overlap(a: Box, b: Box) -> float:
    sides = [min(a[k] + a[k + 2], b[k] + b[k + 2]) - max(a[k], b[k]) for k in (0, 1)]
    shared = max(sides[0], 0) * max(sides[1], 0)
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)


def track(images: list[Path], true: list[Box | None], start: int, end: int, least: float) -> list[float]:
    """Overlaps of the frames after `start`, up to the first below `least` or to `end`."""
    tracker, box = cv2.TrackerCSRT_create(), true[start]
    tracker.init(cv2.imread(str(images[start])), tuple(round(v) for v in box))
    overlaps = []
    for k in range(start + 1, end):
        found, new = tracker.update(cv2.imread(str(images[k])))
        box = new if found else box
        overlaps.append(overlap(box, true[k]) if true[k] else 1.0)
        if overlaps[-1] < least:
            break
    return overlaps


def keys(file: Path) -> tuple[str, int, int]:
    """The name of a target, its number of frames, and the number of key frames."""
    images, true = sorted((file.parent / "img").iterdir()), truth(file)
    count = min(len(images), len(true))
    start = next(k for k, box in enumerate(true) if box)
    found, placed, at = {start: 1.0}, {start}, start
    while at < count:
        overlaps = track(images, true, at, count, LEAST)
        found |= {at + 1 + k: value for k, value in enumerate(overlaps)}
        bad = overlaps and overlaps[-1] < LEAST
        at = at + len(overlaps) if bad else count
        if bad:
            placed.add(at)
            found[at] = 1.0
    while sum(found.values()) / len(found) < MEAN:
        worst = min((k for k in found if k not in placed), key=found.__getitem__)
        placed.add(worst)
        found[worst] = 1.0
        end = min((k for k in placed if k > worst), default=count)
        for k, value in enumerate(track(images, true, worst, end, 0.0)):
            # A person keeps the better one of what there was and what there is.
            found[worst + 1 + k] = max(found[worst + 1 + k], value)
    name = file.parent.name + file.stem.removeprefix("groundtruth_rect")
    return name, count - start, len(placed)


def main() -> None:
    if len(sys.argv) < 2:
        sys.exit("usage: annotator_csrt.py DATASET...")
    print("| target | frames | CSRT |\n|---|---|---|")
    for dataset in sys.argv[1:]:
        files = sorted(Path(dataset).glob("*/groundtruth_rect*.txt"))
        with ProcessPoolExecutor() as pool:
            rows = list(pool.map(keys, files))
        rates = [100 * count / frames for _, frames, count in rows]
        for (name, frames, _), rate in zip(rows, rates):
            print(f"| {name} | {frames} | {rate:.1f} |")
        print(f"| **{Path(dataset).name}** | | {sum(rates) / len(rates):.2f} |", flush=True)


if __name__ == "__main__":
    main()
