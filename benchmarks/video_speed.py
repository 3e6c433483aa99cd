#!/usr/bin/env python3
"""Measures whole runs of `patchlock track` on H.264 videos: wall time of reading, tracking and writing.

    cargo build --release
    python3 -m venv VENV && VENV/bin/pip install opencv-contrib-python-headless
    VENV/bin/python benchmarks/video_speed.py target/release/patchlock --folder CLIPS

It makes the clips with ffmpeg (testsrc2, libx264 preset fast) and takes the least of --repeat runs of:
  - `patchlock track` with a table only, and with --video;
  - the same without ffmpeg on the PATH, by the decoder and the encoder in Rust;
  - `ffmpeg -f null`, which only decodes;
  - OpenCV's CSRT, with OpenCV's own reading, from the same box.
Do not use the machine for anything else. It prints a table, and the load before it began.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CLIPS = {"1280x720": 300, "1920x1080": 300, "3840x2160": 240}
"""Number of frames by the size."""


def clip(folder: Path, size: str, frames: int) -> Path:
    """A video, made if it is missing."""
    path = folder / f"{size}.mp4"
    if not path.exists():
        source = ["-f", "lavfi", "-i", f"testsrc2=size={size}:rate=30", "-frames:v", str(frames)]
        encoder = ["-c:v", "libx264", "-preset", "fast", "-pix_fmt", "yuv420p"]
        subprocess.run(["ffmpeg", "-v", "error", "-y", *source, *encoder, path], check=True)
    return path


def box(size: str) -> tuple[int, int, int, int]:
    """A box around a ninth of the height, in the middle."""
    width, height = map(int, size.split("x"))
    side = height // 9
    return (width - side) // 2, (height - side) // 2, side, side


def csrt(path: Path, size: str) -> None:
    """Tracks with OpenCV."""
    import cv2

    video = cv2.VideoCapture(str(path))
    tracker = cv2.TrackerCSRT_create()
    _, frame = video.read()
    tracker.init(frame, box(size))
    while True:
        there, frame = video.read()
        if not there:
            return
        tracker.update(frame)


def least(repeat: int, command: list[str], **options: object) -> float:
    """Least wall time of a command, in seconds."""
    times = []
    for _ in range(repeat):
        begin = time.monotonic()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, **options)  # type: ignore[call-overload]
        times.append(time.monotonic() - begin)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--folder", type=Path, required=True, help="where the clips are")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--csrt", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.csrt:
        return csrt(arguments.program, arguments.csrt)
    arguments.folder.mkdir(parents=True, exist_ok=True)
    program, load = str(arguments.program.resolve()), os.getloadavg()[0]
    print(f"{os.cpu_count()} processors, load {load:.2f}, least of {arguments.repeat} runs, seconds\n")
    print("| video | frames | `track` | `track --video` | without ffmpeg | `--video` without | ffmpeg | CSRT |")
    print("| ----- | ------ | ------- | --------------- | -------------- | ----------------- | ------ | ---- |")
    for size, frames in CLIPS.items():
        path = clip(arguments.folder, size, frames).resolve()
        with tempfile.TemporaryDirectory() as out:
            track = [program, "track", str(path), "--box", ",".join(map(str, box(size))), "--quiet", "--overwrite"]
            table, video = [*track, "--save", f"{out}/a.csv"], [*track, "--save", f"{out}/a.csv", "--video", f"{out}/a.mp4"]
            bare = {**os.environ, "PATH": out}
            null = ["ffmpeg", "-v", "error", "-i", str(path), "-f", "null", "-"]
            other = [sys.executable, __file__, str(path), "--folder", out, "--csrt", size]
            runs = [(table, {}), (video, {}), (table, {"env": bare}), (video, {"env": bare}), (null, {}), (other, {})]
            times = [least(arguments.repeat, command, **options) for command, options in runs]
        print(f"| {size} | {frames} | " + " | ".join(f"{t:.1f}" for t in times) + " |", flush=True)


if __name__ == "__main__":
    main()
