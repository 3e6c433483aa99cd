#!/usr/bin/env python3
"""Runs other trackers on the same sequences as `patchlock bench` and writes results in the same format.

    python3 benchmarks/peers.py DATA --out results
    patchlock report results --truth DATA --show paper --out report.html

The trackers are OpenCV's CSRT, KCF and MIL, and dlib's correlation_tracker, in the versions of
peers-requirements.txt. The first run creates a virtual environment for them (--venv); everything else needs
only Python 3.11 or newer.

DATA is a folder in the OTB layout: <Name>/img/0001.jpg, <Name>/groundtruth_rect[.k].txt. The protocol is OPE:
one pass, starting from the first box.

How it is measured:
  - If a run crashed or hung, its frames per second are unknown, and so are those of its tracker.
  - One run at a time, each in its own process. So a tracker that crashes or hangs does not affect others, and
    a seed gives the same boxes each time (within a process, MIL's random numbers depend on earlier trackers).
  - The time of a frame is that of init or update only, without reading and decoding the image.
  - OpenCV's threads are set with --threads; dlib's tracker has one thread.
  - OpenCV gets BGR images, dlib RGB; grey images become three equal channels. All use 8 bits per channel.
  - OpenCV's trackers use whole pixels: the first box is rounded (0.5 up), and so is every result. This costs
    up to half a pixel per edge. dlib uses fractions, and the last pixel is inside the box.
  - CSRT, KCF and dlib use no random numbers and run with one seed. MIL runs with --seeds seeds
    (cv2.setRNGSeed).
  - If a tracker returns no box for a frame, raises an exception, hangs or crashes, the box is written as NaN,
    and the score uses the last known box instead. If init fails, the first box is used for the whole run. All
    failures are counted in the run's .json file and printed at the end.

The script can be killed at any time and repeated: complete runs are kept, others are done again.
"""

import argparse
import hashlib
import json
import os
import platform
import re
import selectors
import subprocess
import sys
import time
import venv
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
REQUIREMENTS = HERE / "peers-requirements.txt"
SEQUENCE_TABLE = ROOT / "crates/patchlock-bench/src/dataset/otb_sequences.txt"
# Name of the results folder, and whether the tracker uses random numbers. The names include the library,
# since there are other implementations of MIL.
TRACKERS = {"OpenCV-CSRT": False, "OpenCV-KCF": False, "OpenCV-MIL": True, "dlib": False}
Box = tuple[float, float, float, float]
NO_BOX = (float("nan"),) * 4


# --- Sequences ---------------------------------------------------------------


@dataclass
class Target:
    """One target: the images to track, and its box in the first of them, counted from 1."""

    name: str
    sequence: str
    images: list[Path]
    first: Box


def find_targets(data: Path, wanted: list[str] | None) -> list[Target]:
    """All targets, or those with the wanted names of targets or sequences. Exits with a message on errors."""
    if not data.is_dir():
        fail(f"there is no folder {data}", "name the folder of the sequences")
    found = []
    for truth in sorted(data.glob("*/groundtruth_rect*.txt"), key=lambda path: natural(str(path))):
        part = re.fullmatch(r"groundtruth_rect(?:\.(\d+))?\.txt", truth.name)
        sequence = truth.parent.name
        name = f"{sequence}.{part[1]}" if part and part[1] else sequence
        if part and (not wanted or {name.lower(), sequence.lower()} & {word.lower() for word in wanted}):
            found.append(read_target(name, sequence, truth))
    missing = [
        word
        for word in wanted or []
        if not any(word.lower() in (t.name.lower(), t.sequence.lower()) for t in found)
    ]
    if missing or not found:
        what = f"no sequence {', '.join(missing)}" if missing else "no sequence"
        fail(f"there is {what} in {data}", "a sequence is <Name>/img/*.jpg with <Name>/groundtruth_rect.txt")
    return found


def read_target(name: str, sequence: str, truth: Path) -> Target:
    rows = [line for line in truth.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    try:
        first = tuple(float(word) for word in re.split(r"[,\s]+", rows[0].strip()))
    except (ValueError, IndexError):
        first = ()
    if len(first) != 4 or not first[2] > 0 or not first[3] > 0:
        fail(f"{truth}, line 1 is not a box", "a line is x,y,w,h with positive w and h")
    ends = {".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp"}
    folder = truth.parent / "img"
    images = [path for path in folder.iterdir() if path.suffix.lower() in ends] if folder.is_dir() else []
    images = cut_to_truth(sorted(images, key=lambda path: natural(path.name)), len(rows), name)
    if len(images) != len(rows):
        fail(
            f"{truth} has {len(rows)} rows, but {truth.parent / 'img'} has {len(images)} images",
            "complete the sequence or leave it out",
        )
    return Target(name, sequence, images, first)


def cut_to_truth(images: list[Path], rows: int, name: str) -> list[Path]:
    """The images that belong to the rows of truth: all, or those listed in the table of OTB."""
    if len(images) == rows:
        return images
    lines = SEQUENCE_TABLE.read_text(encoding="utf-8").splitlines()
    entry = next((line.split() for line in lines if line.lower().startswith(f"{name.lower()} ")), [name, "-"])
    for first, last in re.findall(r"(\d+)\.\.(\d+)", entry[1]):
        inside = [
            path for path in images if int(first) <= int(re.search(r"(\d+)$", path.stem)[1]) <= int(last)
        ]
        if len(inside) == rows:
            return inside
    return images


def natural(text: str) -> list:
    """Sort key for natural order: 2 before 10."""
    return [int(word) if word.isdigit() else word for word in re.split(r"(\d+)", text)]


# --- Trackers, in their own process -------------------------------------------


class OpenCv:
    """One of OpenCV's trackers. Boxes are whole pixels, counted from 0."""

    def __init__(self, name: str, seed: int, threads: int):
        import cv2

        self.cv2 = cv2
        cv2.setNumThreads(threads)
        cv2.setRNGSeed(seed)
        self.tracker = getattr(cv2, f"Tracker{name.removeprefix('OpenCV-')}_create")()

    def decode(self, path: str):
        return self.cv2.imread(path, self.cv2.IMREAD_COLOR)

    def init(self, image, box: Box) -> None:
        whole = [int(value + 0.5) for value in (box[0] - 1, box[1] - 1, box[2], box[3])]
        self.tracker.init(image, tuple(whole))

    def update(self, image) -> Box | None:
        found, (x, y, w, h) = self.tracker.update(image)
        return (x + 1, y + 1, w, h) if found else None


class Dlib:
    """dlib's correlation tracker. Boxes are fractional; the last pixel is inside."""

    def __init__(self, _name: str, _seed: int, _threads: int):
        import dlib

        self.dlib = dlib
        self.tracker = dlib.correlation_tracker()

    def decode(self, path: str):
        import numpy
        from PIL import Image

        return numpy.asarray(Image.open(path).convert("RGB"))

    def init(self, image, box: Box) -> None:
        x, y, w, h = box
        self.tracker.start_track(image, self.dlib.drectangle(x - 1, y - 1, x + w - 2, y + h - 2))

    def update(self, image) -> Box | None:
        self.tracker.update(image)
        at = self.tracker.get_position()
        return (at.left() + 1, at.top() + 1, at.width(), at.height())


def work() -> None:
    """The child process: runs one tracker on one sequence.

    Reads the job as JSON from the first line of stdin and writes one line of JSON per frame to stdout.
    """
    job = json.loads(sys.stdin.readline())
    tracker = (Dlib if job["tracker"] == "dlib" else OpenCv)(job["tracker"], job["seed"], job["threads"])
    for k, path in enumerate(job["images"]):
        image = tracker.decode(path)
        if image is None:
            print(json.dumps({"unreadable": path}), flush=True)
            return
        begin = time.perf_counter()
        box, error = None, None
        try:
            box = tracker.init(image, job["first"]) if k == 0 else tracker.update(image)
        except Exception as problem:  # any exception counts as a failure of the tracker
            error = " ".join(f"{type(problem).__name__}: {problem}".split())[:200]
        seconds = time.perf_counter() - begin
        if k == 0:
            box = job["first"]  # the given box, not the tracker's version of it
        print(json.dumps({"box": box, "seconds": seconds, "error": error}), flush=True)
        if k == 0 and error is not None:
            return  # init failed: there is nothing to update


# --- One run ------------------------------------------------------------------


@dataclass
class Job:
    """One tracker on one target with one seed, and the path of its files without extension."""

    tracker: str
    seed: int
    target: Target
    stem: Path


@dataclass
class Run:
    """The results of a tracker: one box and one time per frame."""

    boxes: list[Box] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    without_box: int = 0
    errors: list[str] = field(default_factory=list)


def run(python: Path, job: Job, threads: int, patience: float) -> Run:
    """Runs the child and collects its results. Missing boxes become NaN."""
    target = job.target
    images = [str(path) for path in target.images]
    order = {
        "tracker": job.tracker,
        "seed": job.seed,
        "threads": threads,
        "first": target.first,
        "images": images,
    }
    child = subprocess.Popen(
        [python, __file__, "--work"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    result = Run()
    try:
        child.stdin.write(json.dumps(order).encode() + b"\n")
        child.stdin.flush()
        answers = Lines(child.stdout)
        while len(result.boxes) < len(target.images):
            answer = answers.next(patience)
            if isinstance(answer, str):
                result.errors.append(f"frame {len(result.boxes)}: {answer}")
                result.boxes = result.boxes or [target.first]
                break
            if "unreadable" in answer:
                fail(
                    f"cannot decode {answer['unreadable']}",
                    "restore this frame; the runs that are complete are kept",
                )
            add(result, answer)
            if result.errors and len(result.boxes) == 1:
                break  # init failed
    finally:
        child.kill()
        child.wait()
    missing = len(target.images) - len(result.boxes)
    result.boxes += [NO_BOX] * missing
    result.without_box += missing
    return result


def add(result: Run, answer: dict) -> None:
    box = answer["box"]
    if answer["error"]:
        result.errors.append(f"frame {len(result.boxes)}: {answer['error']}")
    if box is None or not all(abs(value) < 1e9 for value in box):
        box = NO_BOX
        result.without_box += 1
    result.boxes.append(tuple(box))
    result.seconds.append(answer["seconds"])


class Lines:
    """Reads lines of JSON from a pipe, with a time limit for each."""

    def __init__(self, pipe):
        self.pipe = pipe
        self.rest = b""
        os.set_blocking(pipe.fileno(), False)
        self.selector = selectors.DefaultSelector()
        self.selector.register(pipe, selectors.EVENT_READ)

    def next(self, patience: float) -> dict | str:
        """The next line, or a message that says what happened instead."""
        end = time.monotonic() + patience
        while b"\n" not in self.rest:
            if not self.selector.select(max(0.0, end - time.monotonic())):
                return f"no answer within {patience:g} s, stopped"
            more = self.pipe.read(1 << 16)
            if not more:
                return "the tracker's process ended"
            self.rest += more
        line, self.rest = self.rest.split(b"\n", 1)
        return json.loads(line)


# --- Files in the format of `bench` -------------------------------------------


def write(path: Path, text: str) -> None:
    """Writes a file atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def write_run(stem: Path, job: "Job", subject: dict, threads: int, result: Run) -> None:
    """Writes the boxes, then the facts with the hash of the boxes.

    A run is complete if both exist and the hash matches.
    """
    lines = [",".join(f"{value:.6g}" if value == value else "NaN" for value in box) for box in result.boxes]
    boxes = "".join(f"{line}\n" for line in lines)
    x, y, w, h = job.target.first
    facts = {
        "tracker": job.tracker,
        "configuration_hash": hash_of(subject),
        "subject": subject,
        "protocol": "ope",
        "target": job.target.name,
        "seed": job.seed,
        "variant": 0,
        "first": 0,
        "given": {"x": x - 1, "y": y - 1, "w": w, "h": h},
        "frames": len(result.boxes),
        "first_frame": job.target.images[0].name,
        "origin": 1.0,
        "machine": {
            "processor": processor(),
            "cores": os.cpu_count(),
            "system": platform.system().lower(),
            "architecture": platform.machine(),
        },
        "threads": threads,
        "jobs": 1,
        "boxes_sha256": sha256(boxes),
        "seconds": [round(value, 7) for value in result.seconds],
        "frames_without_box": result.without_box,
        "errors": result.errors,
    }
    write(stem.with_suffix(".txt"), boxes)
    write(stem.with_suffix(".json"), json.dumps(facts) + "\n")


def subject_of(python: Path, tracker: str, threads: int) -> dict:
    """Library, versions and settings. Runs that differ in these must not be mixed."""
    freeze = subprocess.run(
        [python, "-m", "pip", "freeze"], capture_output=True, text=True, check=True
    ).stdout.split()
    versions = dict(line.split("==") for line in freeze if "==" in line)
    library = "dlib-bin" if tracker == "dlib" else "opencv-contrib-python-headless"
    settings = {
        "python": platform.python_version(),
        "numpy": versions.get("numpy", "unknown"),
        "threads": str(threads),
        "boxes": "fractions" if tracker == "dlib" else "whole pixels",
    }
    return {
        "kind": "outside",
        "program": f"{library} {versions.get(library, 'unknown')}",
        "settings": settings,
    }


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def hash_of(subject: dict) -> str:
    return sha256(json.dumps(subject, sort_keys=True))


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown"


def begin_folder(folder: Path, tracker: str, subject: dict) -> None:
    """Writes the tracker's manifest, or checks that existing runs were made in the same way."""
    path = folder / "manifest.json"
    if path.is_file():
        before = json.loads(path.read_text(encoding="utf-8")).get("subject", {})
        if before != subject:
            fail(
                f"the runs in {folder} were made with {json.dumps(before)}, now it is {json.dumps(subject)}",
                "name another folder with --out, or remove this one",
            )
        return
    facts = {"format": 1, "tracker": tracker, "configuration_hash": hash_of(subject), "subject": subject}
    write(path, json.dumps(facts, indent=2) + "\n")


def is_complete(stem: Path, frames: int) -> bool:
    try:
        facts = read_facts(stem)
        boxes = stem.with_suffix(".txt").read_text(encoding="utf-8")
        return facts["frames"] == frames and facts["boxes_sha256"] == sha256(boxes)
    except (OSError, ValueError, KeyError):
        return False


def read_facts(stem: Path) -> dict:
    return json.loads(stem.with_suffix(".json").read_text(encoding="utf-8"))


# --- Command line -------------------------------------------------------------


def fail(what: str, advice: str) -> None:
    print(f"error: {what}\nhint: {advice}", file=sys.stderr)
    raise SystemExit(1)


def environment(folder: Path, requirements: Path = REQUIREMENTS) -> Path:
    """The Python of the virtual environment, which is created or updated if necessary."""
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    mark = folder / requirements.name
    wanted = requirements.read_text()
    if not (python.is_file() and mark.is_file() and mark.read_text() == wanted):
        print(f"creating a virtual environment in {folder}", file=sys.stderr)
        if not python.is_file():
            venv.create(folder, with_pip=True)
        if subprocess.run(
            [python, "-m", "pip", "install", "--quiet", "--requirement", requirements]
        ).returncode:
            fail(
                "the packages could not be installed",
                f"this needs a network once; or install {requirements.name} into {folder} by hand",
            )
        mark.write_text(wanted)
    return python


def summary(out: Path, jobs: list[Job]) -> None:
    print(
        f"\n{'tracker':<12} {'runs':>5} {'frames':>7} {'frames per second':>18} {'without box':>12} "
        f"{'runs with errors':>17}"
    )
    for name in dict.fromkeys(job.tracker for job in jobs):
        facts = [read_facts(job.stem) for job in jobs if job.tracker == name]
        fps = speed([seconds for f in facts for seconds in f["seconds"]])
        without, failed = sum(f["frames_without_box"] for f in facts), sum(bool(f["errors"]) for f in facts)
        print(
            f"{name:<12} {len(facts):>5} {sum(f['frames'] for f in facts):>7} {fps:>18} {without:>12} "
            f"{failed:>17}"
        )
    print(f"\nThe boxes are in {out}. patchlock score and patchlock report read them.")


def speed(seconds: list[float]) -> str:
    """Frames per second over the frames that have a time."""
    return f"{len(seconds) / max(sum(seconds), 1e-9):.1f}" if seconds else "-"


def seeds_of(tracker: str, seeds: int) -> range:
    return range(seeds if TRACKERS[tracker] else 1)


def words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def trackers(text: str) -> list[str]:
    known = {name.lower().removeprefix("opencv-"): name for name in TRACKERS}
    asked = [word.lower().removeprefix("opencv-") for word in words(text)]
    unknown = [word for word in asked if word not in known]
    if unknown or not asked:
        raise argparse.ArgumentTypeError(
            f"there is no tracker {', '.join(unknown)}: choose from {', '.join(known)}"
        )
    return list(dict.fromkeys(known[word] for word in asked))


def count(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number of at least 1")
    return int(text)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, metavar="DATA", help="folder of sequences in the OTB layout")
    parser.add_argument(
        "--out", type=Path, required=True, help="folder for the results; each tracker gets its own subfolder"
    )
    parser.add_argument(
        "--trackers",
        type=trackers,
        default=list(TRACKERS),
        help="a selection of csrt,kcf,mil,dlib [default: all]",
    )
    parser.add_argument(
        "--sequences", type=words, help="only these sequences or targets, separated by commas [default: all]"
    )
    parser.add_argument(
        "--seeds", type=count, default=5, help="number of seeds for MIL: 0, 1, ... [default: 5]"
    )
    parser.add_argument("--threads", type=count, default=1, help="threads of OpenCV [default: 1]")
    parser.add_argument(
        "--patience",
        type=float,
        default=60.0,
        metavar="SECONDS",
        help="time limit for a frame; a longer one ends the run [default: 60]",
    )
    parser.add_argument(
        "--venv",
        type=Path,
        default=ROOT / "target/peers-venv",
        help="virtual environment [default: target/peers-venv]",
    )
    return parser.parse_args()


def main() -> None:
    args = arguments()
    targets = find_targets(args.data, args.sequences)
    python = environment(args.venv)
    threads = {name: 1 if name == "dlib" else args.threads for name in args.trackers}
    subjects = {name: subject_of(python, name, threads[name]) for name in args.trackers}
    for name, subject in subjects.items():
        begin_folder(args.out / name, name, subject)
    triples = [
        (name, seed, target)
        for target in targets
        for name in args.trackers
        for seed in seeds_of(name, args.seeds)
    ]
    jobs = [
        Job(name, seed, target, args.out / name / "ope" / target.name / str(seed))
        for name, seed, target in triples
    ]
    for k, job in enumerate(jobs, 1):
        label = f"[{k}/{len(jobs)}] {job.target.name} {job.tracker} seed {job.seed}"
        if is_complete(job.stem, len(job.target.images)):
            print(f"{label}: already done", flush=True)
            continue
        result = run(python, job, threads[job.tracker], args.patience)
        write_run(job.stem, job, subjects[job.tracker], threads[job.tracker], result)
        trouble = f", {result.without_box} without box" if result.without_box else ""
        trouble += f", {len(result.errors)} errors, the first: {result.errors[0]}" if result.errors else ""
        print(f"{label}: {len(result.boxes)} frames, {speed(result.seconds)} per second{trouble}", flush=True)
    summary(args.out, jobs)


if __name__ == "__main__":
    try:
        work() if sys.argv[1:] == ["--work"] else main()
    except KeyboardInterrupt:
        print("\nstopped; complete runs are kept; repeat the command to continue", file=sys.stderr)
        raise SystemExit(130) from None
