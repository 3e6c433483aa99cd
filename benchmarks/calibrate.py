#!/usr/bin/env python3
"""Fits the logistic map from certainty to score of the method `robust`, and says what it is worth elsewhere.

    patchlock bench FIRST --preset robust --out results/first
    patchlock bench SECOND --preset robust --out results/second
    python3 benchmarks/calibrate.py results/first/robust:FIRST results/second/robust:SECOND

Each argument is a tracker's folder and the dataset in the OTB layout that it ran on. A stored score is
1 / (1 + exp(-slope * (certainty - even))) with the `score_slope` and `score_even` of the run's configuration,
so the certainty of each frame follows from it. The fit is a logistic regression of whether the box overlaps
the truth by at least half; a frame without truth is a miss, and the first frame does not count, as in
`patchlock score`. Every fit is tried on every dataset: expected calibration error (ECE, ten bins) and area
under the ROC curve (AUROC, which the map does not change), over all frames of a dataset, where `patchlock
score` has the mean over targets. Requires only Python.
"""

import argparse
import json
import math
import re
import sys
from pathlib import Path

HIT_OVERLAP = 0.5
BINS = 10
# The map of runs whose configuration does not have it.
SLOPE, EVEN = 7.0, 0.41
STEPS = 50

# The certainty of a frame, and whether the box is on the target.
Frame = tuple[float, bool]
# Slope, and the certainty at which the score is one half.
Map = tuple[float, float]
Box = list[float]


def logistic(x: float) -> float:
    # The exponential of a large number does not fit into a float.
    return 1 / (1 + math.exp(-x)) if x > 0 else math.exp(x) / (1 + math.exp(x))


def certainty(score: float, slope: float, even: float) -> float:
    """The inverse of the map. Scores that rounding made 0 or 1 become the nearest number that is not."""
    score = min(max(score, sys.float_info.min), 1 - sys.float_info.epsilon / 2)
    return even + (math.log(score) - math.log1p(-score)) / slope


def overlap(a: Box, b: Box) -> float:
    sides = [min(a[k] + a[k + 2], b[k] + b[k + 2]) - max(a[k], b[k]) for k in (0, 1)]
    shared = max(sides[0], 0) * max(sides[1], 0)
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)


def boxes(path: Path) -> list[Box]:
    """Rows of four numbers that are divided by commas or white space."""
    rows = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        try:
            row = [float(word) for word in re.split(r"[,\s]+", line.strip())]
        except ValueError:
            row = []
        if len(row) != 4:
            sys.exit(f"error: {path}, line {number}: '{line}' is not x, y, width and height")
        rows.append(row)
    return rows


def is_box(row: Box) -> bool:
    return all(map(math.isfinite, row)) and row[2] > 0 and row[3] > 0


def truth(dataset: Path, target: str) -> list[Box]:
    """The truth of `David`, or of `Jogging.1`, which is the first target of `Jogging`."""
    sequence, _, number = target.rpartition(".")
    files = [dataset / target / "groundtruth_rect.txt"]
    if number.isdigit():
        files.append(dataset / sequence / f"groundtruth_rect.{number}.txt")
    for file in files:
        if file.exists():
            return boxes(file)
    sys.exit(f"error: no truth for {target}; looked for {' and '.join(map(str, files))}")


def run(manifest: Path, dataset: Path, args: argparse.Namespace) -> list[Frame]:
    stored = json.loads(manifest.read_text())
    missing = [name for name in ("score", "status") if name not in stored]
    if missing:
        sys.exit(f"error: {manifest}: no {' and '.join(missing)} for each frame")
    settings = stored["subject"].get("configuration", {}).get("robust", {})
    slope = args.slope if args.slope is not None else settings.get("score_slope", SLOPE)
    even = args.even if args.even is not None else settings.get("score_even", EVEN)
    if not slope > 0:
        sys.exit(f"error: {manifest}: the slope is {slope}; a map can be inverted if it is above 0")
    rows, first = boxes(manifest.with_suffix(".txt")), stored["first"]
    true = truth(dataset, stored["target"])[first : first + len(rows)]
    counts = {"boxes": len(rows), "scores": len(stored["score"]), "rows of truth": len(true)}
    if len(set(counts.values())) > 1:
        words = ", ".join(f"{count} {what}" for what, count in counts.items())
        sys.exit(f"error: {manifest}: {words}; they must be equally many")
    known = [certainty(score, slope, even) for score in stored["score"]]
    on = [is_box(b) and overlap(a, b) >= HIT_OVERLAP for a, b in zip(rows, true)]
    return list(zip(known, on))[1:]


def read(argument: str, args: argparse.Namespace) -> list[Frame]:
    folder, _, dataset = argument.rpartition(":")
    if not folder:
        sys.exit(f"error: '{argument}' is not RUNS:DATASET")
    manifests = sorted((Path(folder) / "ope").glob("*/*.json"))
    if not manifests:
        sys.exit(f"error: no runs in {folder}; a tracker's folder has ope/TARGET/SEED.json")
    frames = [frame for manifest in manifests for frame in run(manifest, Path(dataset), args)]
    if len({on for _, on in frames}) < 2:
        sys.exit(f"error: the boxes in {folder} are all on the target, or all off: there is nothing to fit")
    return frames


def fit(frames: list[Frame]) -> Map:
    """Maximum likelihood of a + b * certainty by Newton's method, with a step halved until it improves."""
    a, b = 0.0, 0.0
    best = likelihood(frames, a, b)
    for _ in range(STEPS):
        ga = gb = haa = hab = hbb = 0.0
        for c, on in frames:
            p = logistic(a + b * c)
            error, weight = on - p, p * (1 - p)
            ga, gb = ga + error, gb + error * c
            haa, hab, hbb = haa + weight, hab + weight * c, hbb + weight * c * c
        det = haa * hbb - hab * hab
        if det <= 0:
            sys.exit("error: the certainty is the same on all frames: there is nothing to fit")
        da, db = (hbb * ga - hab * gb) / det, (haa * gb - hab * ga) / det
        new, share = likelihood(frames, a + da, b + db), 1.0
        while new < best and share > 1e-6:
            share /= 2
            new = likelihood(frames, a + share * da, b + share * db)
        if new <= best:
            break
        a, b, best = a + share * da, b + share * db, new
    return b, -a / b


def likelihood(frames: list[Frame], a: float, b: float) -> float:
    """The logarithm of the likelihood, by a sum that does not overflow."""
    signed = (a + b * c if on else -a - b * c for c, on in frames)
    return math.fsum(min(x, 0.0) - math.log1p(math.exp(-abs(x))) for x in signed)


def ece(frames: list[Frame], fitted: Map) -> float:
    """The mean distance between mean score and share on the target, over bins of equal width."""
    slope, even = fitted
    bins = [[0.0, 0] for _ in range(BINS)]
    for c, on in frames:
        score = logistic(slope * (c - even))
        cell = bins[min(int(score * BINS), BINS - 1)]
        cell[0], cell[1] = cell[0] + score, cell[1] + on
    return sum(abs(score - on) for score, on in bins) / len(frames)


def auroc(frames: list[Frame]) -> float:
    """The share of pairs of a hit and a miss in which the hit is more certain; equal ones count half."""
    ordered = sorted(frames)
    pairs = misses = 0.0
    k = 0
    while k < len(ordered):
        end = k
        while end < len(ordered) and ordered[end][0] == ordered[k][0]:
            end += 1
        on = sum(hit for _, hit in ordered[k:end])
        off = end - k - on
        pairs += on * (misses + off / 2)
        misses += off
        k = end
    return pairs / (misses * (len(frames) - misses))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", nargs="+", metavar="RUNS:DATASET", help="a tracker's folder and its dataset")
    parser.add_argument("--slope", type=float, help="of the stored scores; default: the configuration's")
    parser.add_argument("--even", type=float, help="of the stored scores; default: the configuration's")
    args = parser.parse_args()
    sets = {argument.rpartition(":")[2]: read(argument, args) for argument in args.runs}
    if len(sets) < len(args.runs):
        parser.error("each dataset may be given once")
    # What the runs were made with, unless the options say otherwise; then each fit, and the fit over all.
    stored = (args.slope if args.slope is not None else SLOPE, args.even if args.even is not None else EVEN)
    fits = {f"slope {stored[0]:g}, even {stored[1]:g}": stored}
    fits |= {f"fitted on {name}": fit(frames) for name, frames in sets.items()}
    if len(sets) > 1:
        fits["fitted on all"] = fit([frame for frames in sets.values() for frame in frames])
    print("| map | slope | even | tried on | frames | on | ECE | AUROC |\n|---|---|---|---|---|---|---|---|")
    for fitted_on, fitted in fits.items():
        for name, frames in sets.items():
            share = sum(on for _, on in frames) / len(frames)
            print(
                f"| {fitted_on} | {fitted[0]:.2f} | {fitted[1]:.3f} | {name} | {len(frames)} "
                f"| {share:.3f} | {ece(frames, fitted):.4f} | {auroc(frames):.4f} |"
            )


if __name__ == "__main__":
    main()
