#!/usr/bin/env python3
"""Tracks every sequence of a folder in the OTB layout with `patchlock track` and prints DP, AUC and frames a second.

    cargo build --release
    python3 benchmarks/otb.py DATA --seeds 3 [--sequences Crossing,David] [--config my.toml]

DATA holds `<Name>/img/*.jpg` and `<Name>/groundtruth_rect[.k].txt`. The protocol is that of the tracker benchmark (Wu, Lim, Yang, 2013):
one pass from the first box, 1-based boxes, DP = share of frames with a centre distance of at most 20 pixels, AUC = mean success
at 21 overlap thresholds, the first frame included. Needs nothing but Python.
"""

import argparse
import json
import re
import statistics
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
Box = tuple[float, float, float, float]


def read_boxes(path: Path) -> list[Box]:
    lines = path.read_text().split("\n")
    return [tuple(float(v) for v in re.split(r"[,\s]+", line.strip())) for line in lines if line.strip()]


def distance(a: Box, b: Box) -> float:
    dx = (a[0] + (a[2] - 1) / 2) - (b[0] + (b[2] - 1) / 2)
    dy = (a[1] + (a[3] - 1) / 2) - (b[1] + (b[3] - 1) / 2)
    return (dx * dx + dy * dy) ** 0.5


def overlap(a: Box, b: Box) -> float:
    width = max(0.0, min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0]))
    height = max(0.0, min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1]))
    return width * height / (a[2] * a[3] + b[2] * b[3] - width * height)


def score(track: list[Box], truth: list[Box]) -> tuple[float, float]:
    if len(track) != len(truth):
        raise SystemExit(f"error: {len(track)} boxes were tracked, but the truth has {len(truth)}")
    pairs = [(a, b) for a, b in zip(track, truth) if b[2] > 0 and b[3] > 0]
    dp = sum(distance(a, b) <= 20 for a, b in pairs) / len(pairs)
    auc = sum(overlap(a, b) > k * 0.05 for a, b in pairs for k in range(21)) / 21 / len(pairs)
    return dp, auc


def track(folder: Path, truth: Path, frames: int, seed: int, args: argparse.Namespace) -> tuple[list[Box], dict]:
    with tempfile.TemporaryDirectory() as out:
        boxes, summary = Path(out, "boxes.txt"), Path(out, "summary.json")
        command = [args.program, "track", folder / "img", "--box-from", truth, "--end", str(frames), "--seed", str(seed)]
        command += ["--save", boxes, "--summary", summary, "--quiet"]
        command += ["--config", args.config] if args.config else []
        subprocess.run(list(map(str, command)), check=True)
        return read_boxes(boxes), json.loads(summary.read_text())


def targets(data: Path, wanted: str | None) -> list[tuple[str, Path, Path]]:
    found = []
    for truth in sorted(data.glob("*/groundtruth_rect*.txt")):
        part = re.search(r"rect\.?(\d*)\.txt$", truth.name)
        name = truth.parent.name + (f".{part[1]}" if part and part[1] else "")
        if not wanted or name in wanted.split(",") or truth.parent.name in wanted.split(","):
            found.append((name, truth.parent, truth))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--sequences", help="only these, separated by commas")
    parser.add_argument("--config", type=Path, help="a configuration for patchlock track")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/patchlock")
    args = parser.parse_args()
    totals: list[list[tuple[float, float]]] = [[] for _ in range(args.seeds)]
    print("| target | frames | DP | AUC | frames a second |\n|---|---|---|---|---|")
    for name, folder, truth in targets(args.data, args.sequences):
        boxes = read_boxes(truth)
        scores, speeds = [], []
        for seed in range(args.seeds):
            result, summary = track(folder, truth, len(boxes), seed, args)
            scores.append(score(result, boxes))
            speeds.append(summary["tracking_fps"])
            totals[seed].append(scores[-1])
        dp, auc = (" ".join(f"{s[k]:.3f}" for s in scores) for k in (0, 1))
        print(f"| {name} | {len(boxes)} | {dp} | {auc} | {statistics.mean(speeds):.1f} |", flush=True)
    for k, label in ((0, "DP"), (1, "AUC")):
        means = [statistics.mean(s[k] for s in seed) for seed in totals if seed]
        spread = statistics.stdev(means) if len(means) > 1 else 0.0
        print(f"mean {label} {statistics.mean(means):.3f}, spread over seeds {spread:.3f}")


if __name__ == "__main__":
    main()
