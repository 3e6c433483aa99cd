#!/usr/bin/env python3
"""Fits the score of the method `robust`, and says what it is worth elsewhere.

    tools/python/setup.sh
    target/python-venv/bin/python benchmarks/calibrate.py FIRST SECOND

Each argument is a dataset in the OTB layout. The preset `robust` tracks all its targets, and says of each
frame how much of the target is visible (0 while it is lost), how strongly the memory responds elsewhere, and
how well colours tell the target from what is around it, relative to the first frame that is known of. The
score is the logistic function of a weighted sum of the three. The defaults count each target by the square
root of its frames; this script counts all frames alike. The fit is the logistic regression of whether
the box overlaps the truth by at least half; a frame without truth is a miss, and the first frame does not
count, as in `patchlock score`. Every fit is tried on every dataset: expected calibration error (ECE, ten
bins) and area under the ROC curve (AUROC), over all frames of a dataset, where `patchlock score` has the mean
over targets. The first rows are those of the settings as they are.
"""

import argparse
import re
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt

import patchlock

HIT_OVERLAP = 0.5
BINS = 10
STEPS = 50
# The settings of the score, in the order of the columns below.
NAMES = ("score_bias", "score_visible", "score_elsewhere", "score_contrast")
# As in the tracker: the least contrast of the first frame, and the most that a later one is relative to it.
LEAST_CONTRAST, MOST_CONTRAST = 0.05, 1.2

Array = npt.NDArray[np.float64]
# What is known of each frame, one row each after a column of ones; and whether the box is on the target.
Frames = tuple[Array, Array]


def overlap(a: Array, b: Array) -> float:
    sides = np.minimum(a[:2] + a[2:], b[:2] + b[2:]) - np.maximum(a[:2], b[:2])
    shared = float(np.prod(np.maximum(sides, 0)))
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)


def truth(file: Path) -> Array:
    """Rows of four numbers, divided by commas or white space. Pixels count from 1 in the file."""
    rows = []
    for number, line in enumerate(file.read_text().splitlines(), 1):
        words = re.split(r"[,\s]+", line.strip())
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            rows.append([])
        if len(rows[-1]) != 4:
            sys.exit(f"error: {file}, line {number}: '{line}' is not x, y, width and height")
    return np.array(rows) - [1, 1, 0, 0]


def has_box(row: Array) -> bool:
    return bool(np.isfinite(row).all() and row[2] > 0 and row[3] > 0)


def track(sequence: Path, file: Path, settings: dict[str, float]) -> list[list[float]]:
    """The columns of each frame after the first, and whether the box is on the target."""
    true, rows = truth(file), []
    first = None
    config = patchlock.Config()
    for name, value in settings.items():
        setattr(config.robust, name, value)
    for k, image in patchlock.Frames(str(sequence / "img")):
        if k == 0:
            tracker = patchlock.Tracker(image, tuple(true[0]), config)
        elif k < len(true):
            estimate, seen = tracker.update_observed(image)
            parts = estimate.visibility
            visible = 0.0 if parts is None else sum(parts.shares) / 2
            on = has_box(true[k]) and overlap(np.array(estimate.box), true[k]) >= HIT_OVERLAP
            first = seen.contrast if first is None else first
            contrast = min(seen.contrast / max(first, LEAST_CONTRAST), MOST_CONTRAST)
            rows.append([1.0, visible, seen.elsewhere, contrast, float(on)])
    return rows


def read(dataset: Path, settings: dict[str, float]) -> Frames:
    files = sorted(dataset.glob("*/groundtruth_rect*.txt"))
    if not files:
        sys.exit(f"error: {dataset} has no SEQUENCE/groundtruth_rect.txt")
    rows = []
    for number, file in enumerate(files, 1):
        print(f"\r{dataset.name}: target {number} of {len(files)}", end="", file=sys.stderr)
        rows += track(file.parent, file, settings)
    print(file=sys.stderr)
    table = np.array(rows)
    if len(set(table[:, -1])) < 2:
        sys.exit(f"error: the boxes in {dataset} are all on the target, or all off: nothing to fit")
    return table[:, :-1], table[:, -1]


def logistic(sums: Array) -> Array:
    return 1 / (1 + np.exp(-np.clip(sums, -500, 500)))


def fit(frames: Frames) -> Array:
    """Maximum likelihood by Newton's method, with a step halved until it improves."""
    columns, on = frames
    weights = np.zeros(columns.shape[1])

    def likelihood(weights: Array) -> float:
        return -float(np.logaddexp(0, (1 - 2 * on) * (columns @ weights)).sum())

    for _ in range(STEPS):
        score = logistic(columns @ weights)
        hessian = (columns.T * (score * (1 - score))) @ columns
        step = np.linalg.lstsq(hessian, columns.T @ (on - score), rcond=None)[0]
        while likelihood(weights + step) < likelihood(weights) and np.abs(step).max() > 1e-9:
            step = step / 2
        weights = weights + step
        if np.abs(step).max() < 1e-9:
            break
    return weights


def ece(frames: Frames, weights: Array) -> float:
    """The mean distance between mean score and share on the target, over bins of equal width."""
    columns, on = frames
    score = logistic(columns @ weights)
    bins = np.minimum((score * BINS).astype(int), BINS - 1)
    return sum(abs(float((score - on)[bins == k].sum())) for k in range(BINS)) / len(on)


def auroc(frames: Frames, weights: Array) -> float:
    """The share of pairs of a hit and a miss in which the hit has the larger score; equal ones count half."""
    columns, on = frames
    _, place, counts = np.unique(columns @ weights, return_inverse=True, return_counts=True)
    rank = (np.cumsum(counts) - (counts - 1) / 2)[place]
    hits, misses = on.sum(), (1 - on).sum()
    return float((rank[on == 1].sum() - hits * (hits + 1) / 2) / (hits * misses))


def setting(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    return name, float(value)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("datasets", nargs="+", type=Path, metavar="DATASET", help="in the OTB layout")
    parser.add_argument(
        "--set", action="append", default=[], type=setting, metavar="NAME=NUMBER", help="another setting"
    )
    args = parser.parse_args()
    settings = dict(args.set)
    sets = {dataset.name: read(dataset, settings) for dataset in args.datasets}
    if len(sets) < len(args.datasets):
        parser.error("each dataset may be given once")
    defaults = {row.name: row.default for row in patchlock.parameters()}
    fits = {"settings": np.array([float(settings.get(name, defaults[name])) for name in NAMES])}
    fits |= {f"fitted on {name}": fit(frames) for name, frames in sets.items()}
    if len(sets) > 1:
        together = [np.concatenate(parts) for parts in zip(*sets.values())]
        fits["fitted on all"] = fit((together[0], together[1]))
    titles = [name.removeprefix("score_") for name in NAMES]
    print(f"| score | {' | '.join(titles)} | tried on | frames | on | ECE | AUROC |")
    print("|---" * (len(titles) + 6) + "|")
    for fitted_on, weights in fits.items():
        numbers = " | ".join(f"{weight:.2f}" for weight in weights)
        for name, frames in sets.items():
            print(
                f"| {fitted_on} | {numbers} | {name} | {len(frames[1])} | {frames[1].mean():.3f} "
                f"| {ece(frames, weights):.4f} | {auroc(frames, weights):.4f} |"
            )


if __name__ == "__main__":
    main()
