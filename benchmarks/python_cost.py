#!/usr/bin/env python3
"""What `Tracker.update` costs in Python over Rust, and what two Python threads gain.

    tools/python/setup.sh && cargo build --release
    target/python-venv/bin/python benchmarks/python_cost.py cost
    target/python-venv/bin/python benchmarks/python_cost.py threads

Both sides track the same rendered frames with the same settings and seed; their boxes must be the same in all places that the program writes, or nothing is
printed.

cost     In turns, a number of rounds: the program `patchlock track` with its own time of each frame (reading the image not counted), and Python with
         the clock around `update`. Of each frame the shortest time of all rounds counts, which is the one that the machine disturbed least. `inside` is what
         the same call took in Rust (`Estimate.ms`), so around less inside is the cost of the way from Python to Rust and back, frame by frame.
threads  Two trackers of one thread each: one after the other, then side by side on two Python threads. The same with two processes of the program, which
         share no interpreter, says what the machine itself can do.
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
    """`patchlock track` on frames in a folder."""

    def __init__(self, binary: Path, folder: Path, box: patchlock.Box, settings: dict[str, int]) -> None:
        self.boxes = folder / "boxes.jsonl"
        config = folder / "settings.toml"
        config.write_text("".join(f"{name} = {value}\n" for name, value in settings.items()))
        self.command = [
            str(binary),
            "track",
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
    """The estimates, and the milliseconds around each call."""
    tracker = patchlock.Tracker(threads=1, **settings)
    estimates, around = [], []
    for k, frame in enumerate(frames):
        start = time.perf_counter()
        estimate = tracker.update(frame) if k else tracker.init(frame, box)
        around.append((time.perf_counter() - start) * 1e3)
        estimates.append(estimate)
    return estimates, around


def cost(program: Program, frames: Frames, box: patchlock.Box, settings: dict[str, int], rounds: int) -> None:
    rust, around, inside, way = [], [], [], []
    for _ in range(rounds):
        rows = program.rows()
        estimates, times = follow(frames, box, settings)
        same = [
            [row[name] for name in "xywh"] == [round(value, 6) for value in estimate.box]
            for row, estimate in zip(rows, estimates, strict=True)
        ]
        if not all(same):
            raise SystemExit(f"the boxes differ from frame {same.index(False)} on: nothing to compare")
        # The first frame is init and not update.
        rust.append([row["ms"] for row in rows][1:])
        around.append(times[1:])
        inside.append([estimate.ms for estimate in estimates][1:])
        way += [outer - inner for outer, inner in zip(around[-1], inside[-1])]
    best = {
        name: statistics.median(map(min, zip(*runs)))
        for name, runs in [("rust", rust), ("around", around), ("inside", inside)]
    }
    ratios = [min(python) / min(program) - 1 for python, program in zip(zip(*around), zip(*rust))]
    print(
        f"  program {best['rust']:.3f} ms a frame, Python {best['around']:.3f} ms, of these inside {best['inside']:.3f} ms (medians of {len(frames) - 1} frames)"
    )
    print(f"  Python over the program, frame by frame: {statistics.median(ratios):+.2%} (median)")
    middle = statistics.median(way)
    print(
        f"  the way there and back: {middle * 1e3:.0f} us, {middle / best['inside']:.3%} of the frame (median of {len(way)} calls)"
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
            f"  {name}: {statistics.median(gain):.2f} times as fast as one after the other ({min(gain):.2f} to {max(gain):.2f})"
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
                f"{name}: {len(frames)} frames of {scene[0].shape[1]}x{scene[0].shape[0]}, {options.rounds} rounds, one thread a tracker"
            )
            part = {"cost": cost, "threads": threads}[options.part]
            program = Program(options.binary, Path(folder), scene.truth(0), SETTINGS[name])
            part(program, frames, scene.truth(0), SETTINGS[name], options.rounds)


if __name__ == "__main__":
    main()
