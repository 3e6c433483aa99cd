#!/usr/bin/env python3
"""Fits the score of the method `robust`, and says what it is worth on targets that the fit did not see.

    tools/python/setup.sh
    python3 benchmarks/segments.py OTB --out starts/OTB --whole
    target/python-venv/bin/python benchmarks/calibrate.py starts/OTB starts/MINE

Each argument is a dataset in the OTB layout. The preset `robust`, without a network, tracks all its sequences
and says of each frame what the score counts: the means of the visible share, of the memory's response
elsewhere and of how sure the memory of the first sure frames is, and the contrast of colours relative to the
first frame. The score is the logistic function of a weighted sum of these. The fit is a logistic regression,
with a penalty on the weights, of whether the box overlaps the truth by at least half; a frame without truth is
a miss. Frames of a target that is given up take part: nothing is visible of it. Each target counts by the
square root of its frames.

The table has the score as it is set, the fit on all targets, and rows in which each target is scored by a fit
that has not seen it: on the other half of the targets, and on the other datasets. Each half stands also by
itself: where one fit is too sure and the other too unsure, both together look better calibrated than either.
"""

import argparse
import math
import re
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

import paired
import patchlock

STEPS = 50
# Of a squared weight of a column with variance 1, as a share of the weight of all frames.
PENALTY = 0.03
# The settings of the score, in the order of the columns.
ALONE = ("score_bias", "score_visible", "score_elsewhere", "score_contrast", "score_early")
# As in the tracker: the least contrast of the first frame, and the most that a later one is relative to it.
LEAST_CONTRAST, MOST_CONTRAST = 0.05, 1.2

Array = npt.NDArray[np.float64]


class Frames(NamedTuple):
    """What is known of some frames, one row each."""

    columns: Array
    overlap: Array  # -1 without truth
    visible: Array  # the share on this frame
    weight: Array

    @property
    def on(self) -> Array:
        return (self.overlap >= paired.ON).astype(float)

    def only(self, which: npt.NDArray[np.bool_]) -> "Frames":
        return Frames(*(part[which] for part in self))


def track(sequence: Path, settings: dict[str, float]) -> list[list[float]]:
    """The rows of a sequence after its first frame."""
    true = paired.boxes_from_0(sequence / "groundtruth_rect.txt")
    config = patchlock.Config(model="none")
    for name, value in settings.items():
        setattr(config.robust, name, value)
    rows: list[list[float]] = []
    first = 0.0
    for k, image in patchlock.Frames(str(sequence / "img")):
        if k == 0:
            tracker = patchlock.Tracker(image, true[0], config)
        elif k < len(true):
            estimate, seen = tracker.update_observed(image)
            first = first or max(seen.contrast, LEAST_CONTRAST)
            contrast = min(seen.contrast / first, MOST_CONTRAST)
            own = [1.0, seen.mean_visible, seen.mean_elsewhere, contrast, seen.mean_early]
            overlap = paired.overlap(tuple(estimate.box), true[k]) if true[k] else -1.0
            rows.append([*own, overlap, seen.visible])
    return rows


def logistic(sums: Array) -> Array:
    return 1 / (1 + np.exp(-np.clip(sums, -500, 500)))


def regression(columns: Array, frames: Frames, penalties: Array) -> Array:
    """Maximum likelihood, less penalty * weight ** 2 / 2, by Newton's method, with a step halved until it
    improves."""
    on, weight = frames.on, frames.weight
    weights = np.zeros(columns.shape[1])

    def worse(weights: Array) -> float:
        losses = np.logaddexp(0, (1 - 2 * on) * (columns @ weights))
        return float((weight * losses).sum() + (penalties * weights**2).sum() / 2)

    for _ in range(STEPS):
        score = logistic(columns @ weights)
        hessian = (columns.T * (weight * score * (1 - score))) @ columns + np.diag(penalties)
        slope = columns.T @ (weight * (on - score)) - penalties * weights
        step = np.linalg.lstsq(hessian, slope, rcond=None)[0]
        while worse(weights + step) > worse(weights) and np.abs(step).max() > 1e-9:
            step = step / 2
        weights = weights + step
        if np.abs(step).max() < 1e-9:
            break
    return weights


def fit(frames: Frames) -> Array:
    """The weights of the score. A penalty shares what two columns say alike between them, and makes the weights
    too small; a second regression, of intercept and slope without a penalty, makes the score a probability
    again."""
    columns = frames.columns
    penalties = PENALTY * frames.weight.sum() * columns.var(axis=0)
    weights = regression(columns, frames, penalties)
    sums = np.stack([np.ones(len(columns)), columns @ weights], axis=1)
    intercept, slope = regression(sums, frames, np.zeros(2))
    weights = weights * slope
    weights[0] += intercept
    return weights


def unseen(frames: Frames, groups: npt.NDArray[np.str_]) -> Array:
    """The score of each frame by a fit on the other groups of targets."""
    score = np.zeros(len(groups))
    for group in np.unique(groups):
        own = groups == group
        score[own] = logistic(frames.columns[own] @ fit(frames.only(~own)))
    return score


def worth(frames: Frames, score: Array, limits: dict[str, float]) -> list[str]:
    """What a score is worth: the columns of the table."""
    off, on = frames.overlap < paired.OFF, frames.on > 0
    tracked = (score >= limits["score_tracked"]) & (frames.visible >= limits["visible_tracked"])
    lost, sure = score < limits["score_lost"], score >= paired.SURE
    pairs = list(zip(score.tolist(), on.tolist()))

    def share(part: npt.NDArray[np.bool_], whole: npt.NDArray[np.bool_]) -> str:
        return f"{100 * (part & whole).sum() / max(whole.sum(), 1):.1f} %"

    shares = [share(off, tracked), share(tracked, off), share(lost, off), share(lost, on), share(~on, sure)]
    every = np.ones(len(on), bool)
    return [*shares, f"{paired.ece(pairs):.3f}", f"{paired.auroc(pairs):.3f}", share(tracked, every)]


def read(
    datasets: list[Path], one: Callable[[Path], list[list[float]]]
) -> tuple[Frames, list[npt.NDArray[np.str_]]]:
    """All frames, and for each its half and its dataset."""
    sequences = [file.parent for dataset in datasets for file in sorted(dataset.glob("*/groundtruth_rect.txt"))]
    if not sequences:
        sys.exit(f"error: {datasets[0]} has no SEQUENCE/groundtruth_rect.txt")
    names = [re.sub(r"-[frs]\d$", "", folder.name) for folder in sequences]
    tables = []
    with ProcessPoolExecutor() as pool:
        for number, rows in enumerate(pool.map(one, sequences), 1):
            print(f"\rsequence {number} of {len(sequences)}", end="", file=sys.stderr)
            tables.append(np.array(rows))
    print(file=sys.stderr)
    weight = [np.full(len(table), 1 / math.sqrt(len(table))) for table in tables]
    table = np.concatenate(tables)
    frames = Frames(table[:, :-2], table[:, -2], table[:, -1], np.concatenate(weight))
    if len(set(frames.on)) < 2:
        sys.exit("error: all boxes are on the target, or all are off: nothing to fit")
    counts = [len(table) for table in tables]
    halves = np.repeat([paired.half(name) for name in names], counts)
    return frames, [halves, np.repeat([folder.parent.name for folder in sequences], counts)]


class SequenceTracker(NamedTuple):
    """Tracks a sequence in another process."""

    settings: dict[str, float]

    def __call__(self, sequence: Path) -> list[list[float]]:
        return track(sequence, self.settings)


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
    frames, groups = read(args.datasets, SequenceTracker(settings))
    limits = {row.name: row.default for row in patchlock.parameters(research=True)} | settings
    fitted = fit(frames)
    rows = {
        "as it is set": logistic(frames.columns @ np.array([float(limits[name]) for name in ALONE])),
        "fitted on all": logistic(frames.columns @ fitted),
        "fitted on the other half": unseen(frames, groups[0]),
    }
    if len(args.datasets) > 1:
        rows["fitted on the other sets"] = unseen(frames, groups[1])
    print(" ".join(f"{name}={value:.2f}" for name, value in zip(ALONE, fitted)) + "\n")
    titles = "tracked that are off, off called tracked, off called lost, on called lost, >= .9 missed, ECE, AUROC, called tracked"
    print(f"| score | {titles.replace(', ', ' | ')} |")
    print("|---" * 9 + "|")
    for name, score in rows.items():
        print(f"| {name} | {' | '.join(worth(frames, score, limits))} |")
    for half in np.unique(groups[0]):
        own = groups[0] == half
        values = worth(frames.only(own), rows["fitted on the other half"][own], limits)
        print(f"| half {half}, fitted on the other | {' | '.join(values)} |")


if __name__ == "__main__":
    main()
