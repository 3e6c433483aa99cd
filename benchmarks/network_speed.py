#!/usr/bin/env python3
"""Measures the speed of whole sequences: this tracker beside a network's plain loop and other trackers.

    cargo build --release
    python3 benchmarks/network_speed.py DATA --network BACKBONE.onnx HEAD.onnx \\
        --ours robust --ours network=SETTINGS.toml --record network-speed.md

DATA is a folder in the OTB layout. --network is NanoTrack's two files or VitTrack's one. The first run
creates virtual environments for the other software (peers-requirements.txt and speed-requirements.txt). Do
not use the machine for anything else.

Measured are, one after the other, each with --threads:
  - this tracker, by `patchlock bench --jobs 1`, with each preset of --ours and its settings, if any;
  - the loop of tools/oracles/network.py with onnxruntime, but OpenCV cuts the windows, which is faster;
  - OpenCV's CSRT and dlib's tracker (one thread), as in peers.py.

Frames per second are the number of updates over the sum of their times, without reading and decoding images.
"""

import argparse
import datetime
import json
import sys
import tempfile
import time
from pathlib import Path

import peers
import speed

ROOT = Path(__file__).resolve().parent.parent
PEERS = ["OpenCV-CSRT", "dlib"]


def ours(args: argparse.Namespace, target: peers.Target, preset: str) -> list[float]:
    """Time of each update in seconds. `preset` is its name, or name=FILE.toml."""
    name, _, settings = preset.partition("=")
    with tempfile.TemporaryDirectory() as out:
        words = ["--sequences", target.name, "--preset", name, "--name", "ours", "--out", out, "--quiet"]
        words += ["--threads", args.threads, "--jobs", 1]
        words += ["--config", settings] if settings else []
        speed.call(args.program, "bench", args.data, *words)
        run = next((Path(out) / "ours/ope" / target.name).glob("*.json"))  # named after the seed
        return json.loads(run.read_text())["seconds"][1:]


def loop(python: Path, args: argparse.Namespace, target: peers.Target) -> list[float]:
    job = {
        "networks": [str(path) for path in args.network],
        "threads": args.threads,
        "first": target.first,
        "images": [str(path) for path in target.images],
    }
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(job, file)
        file.flush()
        return json.loads(speed.call(python, __file__, "--loop", file.name))


def loop_child(job: dict) -> None:
    """The child process: follows one target and prints the seconds of each update."""
    import cv2

    sys.path.append(str(ROOT / "tools/oracles"))
    import network

    def cut(frame, centre, side, size, fill):
        scale = side / size
        corner = [middle - (size - 1) / 2 * scale for middle in centre]
        to_frame = network.np.array([[scale, 0, corner[0]], [0, scale, corner[1]]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        border = tuple(network.np.broadcast_to(fill, 3).tolist())
        return cv2.warpAffine(frame, to_frame, (size, size), flags=flags, borderValue=border)

    cv2.setNumThreads(job["threads"])
    tracker = network.load(job["networks"], job["threads"], cut)
    x, y, w, h = job["first"]
    seconds = []
    for k, path in enumerate(job["images"]):
        frame = network.read(path)
        if k == 0:
            tracker.start(frame, (x - 1, y - 1, w, h))
            continue
        begin = time.perf_counter()
        tracker.update(frame)
        seconds.append(time.perf_counter() - begin)
    print(json.dumps(seconds))


def measure(args: argparse.Namespace, targets: list[peers.Target]) -> dict[str, list[list[float]]]:
    """The seconds of each tracker on each target."""
    python, other = peers.environment(args.venv, speed.REQUIREMENTS), peers.environment(args.peers_venv)
    rows: dict[str, list[list[float]]] = {}
    for target in targets:
        for preset in args.ours:
            rows.setdefault(f"patchlock, {preset.partition('=')[0]}", []).append(ours(args, target, preset))
        rows.setdefault("network, onnxruntime", []).append(loop(python, args, target))
        for tracker in PEERS:
            threads = 1 if tracker == "dlib" else args.threads
            rows.setdefault(tracker, []).append(speed.theirs(other, tracker, target, threads))
        print(f"{target.name} done", file=sys.stderr)
    return rows


def table(rows: dict[str, list[list[float]]], targets: list[peers.Target]) -> str:
    names = [target.name for target in targets]
    lines = [f"| frames per second | {' | '.join(names)} | all |", "|---" * (len(names) + 2) + "|"]
    for name, runs in rows.items():
        every = [second for run in runs for second in run]
        lines.append(f"| {name} | {' | '.join(peers.speed(run) for run in [*runs, every])} |")
    return "\n".join(lines)


def record(args: argparse.Namespace, text: str) -> str:
    files = (peers.REQUIREMENTS, speed.REQUIREMENTS)
    versions = sorted({line for file in files for line in file.read_text().split()})
    program = speed.call(args.program, "--version").strip()
    machine = f"{peers.processor()}, {peers.os.cpu_count()} cores"
    hashes = [
        f"{path.name} (SHA-256 {peers.hashlib.sha256(path.read_bytes()).hexdigest()})"
        for path in args.network
    ]
    made = f"{program}; {machine}; threads: {args.threads}; {', '.join(versions)}; {', '.join(hashes)}."
    return "\n".join([f"# {datetime.date.today()}: speed beside a network", "", made, "", text, ""])


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, metavar="DATA", help="folder of sequences in the OTB layout")
    parser.add_argument("--network", type=Path, nargs="+", required=True, metavar="FILE.onnx")
    parser.add_argument(
        "--ours",
        action="append",
        metavar="PRESET[=FILE.toml]",
        help="a preset of this tracker, with settings; may be repeated [default: robust]",
    )
    parser.add_argument(
        "--sequences", type=peers.words, help="only these sequences or targets, separated by commas"
    )
    parser.add_argument("--threads", type=peers.count, default=1, help="threads of each tracker [default: 1]")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/patchlock")
    parser.add_argument("--venv", type=Path, default=ROOT / "target/speed-venv")
    parser.add_argument("--peers-venv", type=Path, default=ROOT / "target/peers-venv")
    parser.add_argument("--record", type=Path, help="file for the table as Markdown [default: only print it]")
    args = parser.parse_args()
    args.ours = args.ours or ["robust"]
    return args


def main() -> None:
    args = arguments()
    if not args.program.is_file():
        peers.fail(f"there is no program {args.program}", "build it first: cargo build --release")
    targets = peers.find_targets(args.data, args.sequences)
    text = table(measure(args, targets), targets)
    print(text)
    if args.record:
        peers.write(args.record, record(args, text))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--loop", job]:
            loop_child(json.loads(Path(job).read_text()))
        case _:
            main()
