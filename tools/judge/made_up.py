#!/usr/bin/env python3
"""Writes the synthetic truth and boxes that the judge scores: made_up.py FOLDER

They cover everything in which conventions differ: a first box that differs from the truth, missing boxes,
frames without truth, and distances and overlaps exactly on a threshold.
"""

import random
import sys
from pathlib import Path

NAN = ("NaN",) * 4


def walk(rng: random.Random, count: int) -> list[list[float]]:
    """A target that wanders and changes its size, to hundredths of a pixel."""
    x, y, w, h = 90.0, 70.0, 44.0, 60.0
    rows = []
    for _ in range(count):
        rows.append([round(v, 2) for v in (x, y, w, h)])
        x, y = x + rng.uniform(-4, 5), y + rng.uniform(-4, 4)
        w, h = max(9.0, w * rng.uniform(0.96, 1.05)), max(9.0, h * rng.uniform(0.96, 1.05))
    return rows


def follow(rng: random.Random, truth: list[list[float]], drift: float) -> list[list[float]]:
    """Boxes with small errors that grow towards the end."""
    rows = []
    for k, (x, y, w, h) in enumerate(truth):
        far = drift * k
        rows.append(
            [
                round(v, 2)
                for v in (
                    x + rng.gauss(far, 2),
                    y + rng.gauss(0, 2),
                    w * rng.uniform(0.8, 1.2),
                    h * rng.uniform(0.8, 1.2),
                )
            ]
        )
    rows[0] = list(truth[0])
    return rows


def write(path: Path, rows: list) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        "".join(",".join(f"{v:g}" if isinstance(v, float) else str(v) for v in row) + "\n" for row in rows)
    )


def main() -> None:
    root = Path(sys.argv[1])
    rng = random.Random(2013)
    # plain: nothing unusual, so both scores must be equal.
    plain = walk(rng, 80)
    write(root / "truth/plain.txt", plain)
    write(root / "results/steady/plain.txt", follow(rng, plain, 0.1))
    write(root / "results/broken/plain.txt", follow(rng, plain, 0.8))
    # edges: distances of exactly t pixels and overlaps of exactly multiples of 0.05, without rounding errors.
    edges = [[11, 21, 40, 40]] * 72
    write(root / "truth/edges.txt", edges)
    write(root / "results/steady/edges.txt", [[11 + k, 21, 40, 40] for k in range(72)])
    write(root / "results/broken/edges.txt", [[11, 21, 40, 40 - 2 * (k % 20)] for k in range(72)])
    # gaps: frames without truth, as NaN and as a box of size 0, also next to plausible boxes.
    gaps = walk(rng, 60)
    for k in (7, 8, 30):
        gaps[k] = NAN
    for k, near in ((12, 1), (13, 1), (40, 0)):
        gaps[k] = [gaps[k][0] + 20, gaps[k][1] + 20, 0, 0] if near else [0, 0, 0, 0]
    walked = [row if row is not NAN else [95.0, 75.0, 40.0, 60.0] for row in gaps]
    write(root / "truth/gaps.txt", gaps)
    write(root / "results/steady/gaps.txt", follow(rng, walked, 0.1))
    write(root / "results/broken/gaps.txt", follow(rng, walked, 0.5))
    # holes: missing boxes, and a first box that differs from the truth.
    holes = walk(rng, 50)
    write(root / "truth/holes.txt", holes)
    steady, broken = follow(rng, holes, 0.1), follow(rng, holes, 0.3)
    steady[0] = [140.0, 120.0, 20.0, 20.0]
    for k in (5, 20, 21, 22, 49):
        broken[k] = NAN
    write(root / "results/steady/holes.txt", steady)
    write(root / "results/broken/holes.txt", broken)


if __name__ == "__main__":
    main()
