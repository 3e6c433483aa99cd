#!/usr/bin/env python3
"""Measures the overhead of `Tracker.update` in Python over Rust, and the speedup of two Python threads.

    tools/python/setup.sh && cargo build --release
    target/python-venv/bin/python benchmarks/python_cost.py cost
    target/python-venv/bin/python benchmarks/python_cost.py threads

Both sides track the same rendered frames with the same settings and seed. Their boxes must be equal to the
precision of the program's output, or nothing is printed.

cost     Alternates between the program `patchlock track`, which reports its own time for each frame (without
         reading the image), and Python, timed around `update`. The minimum over all rounds counts for each
         frame, as it is least affected by other load. `inside` is the time of the same call in Rust
         (`Estimate.ms`), so the difference to `around` is the overhead of calling Rust from Python.
threads  Two trackers with one thread each: first sequentially, then in parallel on two Python threads. Two
         processes of the program, which share no interpreter, show the speedup that the machine allows.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

import patchlock

ROOT = Path(__file__).resolve().parents[1]
SETTINGS = {"paper": {}, "cheap": {"particles": 30, "small_step": 8}}
Frames = list[npt.NDArray[np.uint8]]


class Program:
    """Runs `patchlock track` on the frames in a folder."""

    def __init__(self, binary: Path, folder: Path, box: patchlock.Box, settings: dict[str, int]) -> None:
        self.boxes = folder / "boxes.jsonl"
        config = folder / "settings.toml"
        config.write_text("".join(f"{name} = {value}\n" for name, value in settings.items()))
        self.command = [
            str(binary),
            "track",
            "--preset",
            "paper",
            str(folder / "%04d.bmp"),
            "--quiet",
            "--overwrite",
            "--threads",
            "1",
        ]
        self.command += ["--box", ",".join(map(str, box)), "--config", str(config)]

    def rows(self) -> list[dict[str, float]]:
        subprocess.run([*self.command, "--save", str(self.boxes)], check=True)
        return [json.loads(line) for line in self.boxes.read_text().splitlines()]

    def begin(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(self.command, stdout=subprocess.DEVNULL)


def follow(
    frames: Frames, box: patchlock.Box, settings: dict[str, int]
) -> tuple[list[patchlock.Estimate], list[float]]:
    """The estimates, and the time around each call in milliseconds."""
    config = patchlock.Config("paper")
    for name, value in settings.items():
        group = config.paper if hasattr(config.paper, name) else config.paper.patches
        setattr(group, name, value)
    start = time.perf_counter()
    tracker = patchlock.Tracker(frames[0], box, config, threads=1)
    around = [(time.perf_counter() - start) * 1e3]
    estimates = [tracker.estimate]
    for frame in frames[1:]:
        start = time.perf_counter()
        estimates.append(tracker.update(frame))
        around.append((time.perf_counter() - start) * 1e3)
    return estimates, around


def cost(program: Program, frames: Frames, box: patchlock.Box, settings: dict[str, int], rounds: int) -> None:
    rust, around, inside, overhead = [], [], [], []
    for _ in range(rounds):
        rows = program.rows()
        estimates, times = follow(frames, box, settings)
        same = [
            [row[name] for name in "xywh"] == [round(value, 6) for value in estimate.box]
            for row, estimate in zip(rows, estimates, strict=True)
        ]
        if not all(same):
            raise SystemExit(f"the boxes differ from frame {same.index(False)} on: can't compare")
        # The first frame starts the tracker.
        rust.append([row["ms"] for row in rows][1:])
        around.append(times[1:])
        inside.append([estimate.ms for estimate in estimates][1:])
        overhead += [outer - inner for outer, inner in zip(around[-1], inside[-1])]
    best = {
        name: statistics.median(map(min, zip(*runs)))
        for name, runs in [("rust", rust), ("around", around), ("inside", inside)]
    }
    ratios = [min(python) / min(program) - 1 for python, program in zip(zip(*around), zip(*rust))]
    print(
        f"  program {best['rust']:.3f} ms per frame, Python {best['around']:.3f} ms, "
        f"of which inside {best['inside']:.3f} ms (medians of {len(frames) - 1} frames)"
    )
    print(f"  Python relative to the program, per frame: {statistics.median(ratios):+.2%} (median)")
    middle = statistics.median(overhead)
    print(
        f"  overhead of a call: {middle * 1e3:.0f} us, {middle / best['inside']:.3%} of the frame "
        f"(median of {len(overhead)} calls)"
    )


def seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def threads(
    program: Program, frames: Frames, box: patchlock.Box, settings: dict[str, int], rounds: int
) -> None:
    def on_two_threads() -> None:
        both = [threading.Thread(target=follow, args=(frames, box, settings)) for _ in range(2)]
        for thread in both:
            thread.start()
        for thread in both:
            thread.join()

    def twice(work: Callable[[], object]) -> None:
        work()
        work()

    def two_processes() -> None:
        for process in [program.begin(), program.begin()]:
            process.wait()

    gains: dict[str, list[float]] = {"Python, two threads": [], "program, two processes": []}
    for _ in range(rounds):
        one = seconds(lambda: twice(lambda: follow(frames, box, settings)))
        gains["Python, two threads"].append(one / seconds(on_two_threads))
        one = seconds(lambda: twice(lambda: program.begin().wait()))
        gains["program, two processes"].append(one / seconds(two_processes))
    for name, gain in gains.items():
        print(
            f"  {name}: {statistics.median(gain):.2f} times as fast as sequentially "
            f"({min(gain):.2f} to {max(gain):.2f})"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=["cost", "threads"])
    parser.add_argument("--binary", type=Path, default=ROOT / "target/release/patchlock")
    parser.add_argument("--settings", choices=SETTINGS, action="append", help="default: all of them")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    scene = patchlock.Scene("demo")
    frames = [scene[k] for k in range(options.frames)]
    with tempfile.TemporaryDirectory() as folder:
        for k, frame in enumerate(frames):
            Image.fromarray(frame).save(Path(folder) / f"{k:04}.bmp")
        for name in options.settings or SETTINGS:
            print(
                f"{name}: {len(frames)} frames of {scene[0].shape[1]}x{scene[0].shape[0]}, "
                f"{options.rounds} rounds, one thread per tracker"
            )
            part = {"cost": cost, "threads": threads}[options.part]
            program = Program(options.binary, Path(folder), scene.truth(0), SETTINGS[name])
            part(program, frames, scene.truth(0), SETTINGS[name], options.rounds)


if __name__ == "__main__":
    main()
