#!/usr/bin/env python3
"""Measures speed: whole runs compared with other trackers and another solver, and how the cost grows.

    cargo build --release && cargo build --release -p patchlock-bench --example somp_problems
    python3 benchmarks/speed.py runs DATA --record speed.md
    python3 benchmarks/speed.py curves DATA --out curves

DATA is a folder in the OTB layout. The first run creates virtual environments for the other software
(peers-requirements.txt and speed-requirements.txt). Do not use the machine for anything else: all
measurements are sequential, and load slows them down unequally.

`runs` measures, on the first --frames frames of each sequence:
  - this tracker with the preset `paper`, on one thread and on --threads, with `patchlock bench`: the time of
    `update` only, without decoding;
  - OpenCV's CSRT, MIL and KCF and dlib's tracker on the same frames from the same box, with --threads (dlib
    has one), as in peers.py;
  - SPAMS' `somp` on one thread: the joint codes of one frame (--somp-frame), for --somp-particles of its
    particles at all locations of both scales. The problems come from our tracker (the example somp_problems),
    which codes all particles of the frame on one thread, so both solve the same problems. SPAMS' time is
    scaled to all particles. The number of problems for which both choose the same atoms is counted.

Frames per second are 1 / median time of an update; the column `median` is the median over the sequences.

`curves` measures the tracker alone, on --sequence. One setting is changed at a time; the others are those of
`paper` on one thread.
"""

import argparse
import csv
import datetime
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import peers

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
REQUIREMENTS = HERE / "speed-requirements.txt"
ATOMS = 4
CURVES: dict[str, list[int]] = {
    "particles": [50, 100, 200, 400, 650, 1000, 2000, 5000],
    "small_step": [1, 2, 4],
    "templates": [5, 10, 20, 30, 40],
    "threads": [1, 2],
}


# --- Our tracker --------------------------------------------------------------


def call(*words: object) -> str:
    result = subprocess.run(list(map(str, words)), stdout=subprocess.PIPE, text=True)
    if result.returncode:
        peers.fail(
            f"`{' '.join(map(str, words))}` exited with code {result.returncode}", "its output is above"
        )
    return result.stdout


def shorten(target: peers.Target, frames: int, folder: Path) -> peers.Target:
    """A sequence of links to the first frames."""
    images = folder / target.name / "img"
    images.mkdir(parents=True)
    short = []
    for k, path in enumerate(target.images[:frames], 1):
        link = images / f"{k:04}{path.suffix}"
        link.symlink_to(path.resolve())
        short.append(link)
    line = ",".join(map(str, target.first)) + "\n"
    (folder / target.name / "groundtruth_rect.txt").write_text(line * len(short))
    return peers.Target(target.name, target.name, short, target.first)


def ours(program: Path, target: peers.Target, threads: int, settings: dict[str, int]) -> list[float]:
    """Time of each update in seconds."""
    with tempfile.TemporaryDirectory() as out:
        config = Path(out) / "settings.toml"
        config.write_text("".join(f"{name} = {value}\n" for name, value in settings.items()))
        data = target.images[0].parents[2]
        words = [
            "--sequences",
            target.name,
            "--preset",
            "paper",
            "--config",
            config,
            "--name",
            "ours",
            "--out",
            out,
            "--threads",
            threads,
            "--jobs",
            1,
        ]
        call(program, "bench", data, *words)
        facts = json.loads((Path(out) / "ours/ope" / target.name / "0.json").read_text())
    return facts["seconds"][1:]


# --- Other software -----------------------------------------------------------


def theirs(python: Path, tracker: str, target: peers.Target, threads: int) -> list[float]:
    result = peers.run(python, peers.Job(tracker, 0, target, Path()), threads, 60.0)
    if result.errors:
        print(f"note: {tracker} on {target.name}: {result.errors[0]}", file=sys.stderr)
    return result.seconds[1:]


def compare_somp(python: Path, args: argparse.Namespace, target: peers.Target) -> dict:
    """The times of SPAMS and of our solver for the codes of one frame, in milliseconds."""
    with tempfile.TemporaryDirectory() as folder:
        data = target.images[0].parents[2]
        example = args.program.parent / "examples/somp_problems"
        our = json.loads(call(example, data, target.name, args.somp_frame, args.somp_particles, folder))
        their = json.loads(call(python, __file__, "--somp", folder))
    particles = our["particles"]
    spams = sum(their[s]["seconds"] for s in ("large", "small")) * 1e3 * particles / args.somp_particles
    codes = our["large"]["codes_ms"] + our["small"]["codes_ms"]
    same, count = (sum(their[s][key] for s in ("large", "small")) for key in ("same", "count"))
    return {
        "sequence": target.name,
        "particles": particles,
        "spams_ms": spams,
        "ours_ms": codes,
        "ratio": spams / codes,
        "same": same,
        "count": count,
    }


def somp_child(folder: Path) -> None:
    """The child process: runs SPAMS on the problems in a folder.

    Prints the seconds, and the number of problems for which the atoms are the same.
    """
    import numpy as np
    import spams

    answer = {}
    for scale in ("large", "small"):
        dictionary, shared, patches, atoms = (
            np.load(folder / scale / f"{name}.npy") for name in ("dictionary", "shared", "patches", "atoms")
        )
        count = patches.shape[0] * patches.shape[1]
        columns = np.concatenate(
            [patches[:, :, None, :], np.broadcast_to(shared, (len(patches), *shared.shape))], axis=2
        )
        signals = np.asfortranarray(columns.reshape(-1, patches.shape[2]).T.astype(np.float64))
        groups = np.arange(0, signals.shape[1], columns.shape[2], dtype=np.int32)
        atoms_f64 = np.asfortranarray(dictionary.T.astype(np.float64))
        seconds, codes = [], None
        for _ in range(3):
            begin = peers.time.perf_counter()
            codes = spams.somp(signals, atoms_f64, groups, L=ATOMS, eps=0.0, numThreads=1)
            seconds.append(peers.time.perf_counter() - begin)
        codes = codes.tocsc()
        chosen = [set(codes[:, first].indices) for first in groups]
        ours_chosen = [set(row[row >= 0]) for row in atoms.reshape(count, -1)]
        answer[scale] = {
            "seconds": statistics.median(seconds),
            "same": sum(a == b for a, b in zip(chosen, ours_chosen)),
            "count": count,
        }
    print(json.dumps(answer))


# --- Whole runs ---------------------------------------------------------------


def fps(seconds: list[float]) -> float:
    return 1.0 / statistics.median(seconds) if seconds else float("nan")


def whole_runs(args: argparse.Namespace) -> str:
    python = peers.environment(args.peers_venv)
    solver = peers.environment(args.venv, REQUIREMENTS)
    targets = peers.find_targets(args.data, args.sequences)
    rows: dict[str, list[float]] = {}
    codes, updates = [], []
    with tempfile.TemporaryDirectory() as folder:
        for long in targets:
            target = shorten(long, args.frames, Path(folder))
            for threads in dict.fromkeys([1, args.threads]):
                seconds = ours(args.program, target, threads, {})
                rows.setdefault(f"patchlock, {threads} thread{'s' * (threads > 1)}", []).append(fps(seconds))
                if threads == 1:
                    updates.append(statistics.median(seconds) * 1e3)
            for tracker in peers.TRACKERS:
                rows.setdefault(tracker, []).append(fps(theirs(python, tracker, target, args.threads)))
            codes.append(compare_somp(solver, args, target))
            print(f"{target.name} done", file=sys.stderr)
    return "\n".join([*speed_table(rows, targets), "", *somp_table(codes, updates)])


def speed_table(rows: dict[str, list[float]], targets: list[peers.Target]) -> list[str]:
    names = [target.name for target in targets]
    lines = [f"| frames per second | {' | '.join(names)} | median |", "|---" * (len(names) + 2) + "|"]
    for name, values in rows.items():
        cells = [f"{value:.1f}" for value in [*values, statistics.median(values)]]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def somp_table(codes: list[dict], updates: list[float]) -> list[str]:
    """Times on one core: the codes of a whole frame by SPAMS and by us, and our whole update.

    The update is faster than all codes, because candidates that can't win are dropped early.
    """
    head = ["sequence", "SPAMS `somp`, s", "our codes, ms", "ratio", "our update, ms", "ratio", "same atoms"]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for code, update in zip(codes, updates):
        cells = [
            code["sequence"],
            f"{code['spams_ms'] / 1e3:.1f}",
            f"{code['ours_ms']:.0f}",
            f"{code['ratio']:.0f}",
        ]
        cells += [f"{update:.1f}", f"{code['spams_ms'] / update:.0f}", f"{code['same']} of {code['count']}"]
        lines.append(f"| {' | '.join(cells)} |")
    ratios = [
        statistics.median(values)
        for values in ([c["ratio"] for c in codes], [c["spams_ms"] / u for c, u in zip(codes, updates)])
    ]
    return [*lines, f"| median | | | {ratios[0]:.0f} | | {ratios[1]:.0f} | |"]


def record(args: argparse.Namespace, table: str) -> str:
    versions = [line for file in (peers.REQUIREMENTS, REQUIREMENTS) for line in file.read_text().split()]
    program = call(args.program, "--version").strip()
    made = (
        f"{program}; {peers.processor()}, {peers.os.cpu_count()} cores; {', '.join(sorted(set(versions)))}."
    )
    command = f"    python3 benchmarks/speed.py runs DATA --frames {args.frames} --threads {args.threads}"
    notes = [
        f"The first {args.frames} frames of each sequence, preset `paper`, without decoding. Frames per",
        f"second are 1 / median time of an update. OpenCV has {args.threads} threads, dlib one.",
        "",
        f"`somp`: all joint codes of frame {args.somp_frame} on one core; SPAMS' time is scaled from",
        f"{args.somp_particles} particles. Our codes are those of every candidate. Our update is a median",
        "over the frames on one core and includes warping and learning; candidates that can't win are",
        "dropped early.",
    ]
    return "\n".join([f"# {datetime.date.today()}: speed", "", made, "", command, "", *notes, "", table, ""])


# --- Curves -------------------------------------------------------------------


def curves(args: argparse.Namespace) -> None:
    python = peers.environment(args.venv, REQUIREMENTS)
    target = peers.find_targets(args.data, [args.sequence])[0]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        short = shorten(target, args.frames, Path(folder))
        for setting, values in CURVES.items():
            for value in values:
                settings = {} if setting == "threads" else {setting: value}
                seconds = ours(args.program, short, value if setting == "threads" else 1, settings)
                rows.append(
                    {
                        "setting": setting,
                        "value": value,
                        "median_ms": round(statistics.median(seconds) * 1e3, 3),
                    }
                )
                print(f"{setting} {value}: {rows[-1]['median_ms']} ms", flush=True)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    table = args.out.with_suffix(".csv")
    with table.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    title = f"preset paper, {target.name}, {args.frames} frames"
    call(python, __file__, "--draw", table, args.out.with_suffix(".svg"), title)


def draw_child(table: Path, picture: Path, title: str) -> None:
    """The child process: draws the table."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "patchlock"
    from matplotlib import pyplot

    with table.open() as file:
        rows = list(csv.DictReader(file))
    figure, axes = pyplot.subplots(1, len(CURVES), figsize=(14, 3.6))
    for place, setting in zip(axes, CURVES):
        points = [(int(r["value"]), float(r["median_ms"])) for r in rows if r["setting"] == setting]
        xs, ys = zip(*points)
        place.loglog(xs, ys, "o-", base=10)
        place.set(xlabel=setting, xticks=xs, xticklabels=xs, title="")
        place.minorticks_off()
        for x, y in points:
            place.annotate(
                f"{y:.3g}", (x, y), textcoords="offset points", xytext=(0, 6), ha="center", fontsize=8
            )
        place.margins(0.12, 0.25)
        place.tick_params(axis="x", labelsize=7)
    axes[0].set_ylabel("ms per update (median)")
    figure.suptitle(title)
    figure.tight_layout()
    figure.savefig(picture, metadata={"Date": None})


# --- Command line -------------------------------------------------------------


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("data", type=Path, metavar="DATA", help="folder of sequences in the OTB layout")
    shared.add_argument(
        "--program",
        type=Path,
        default=ROOT / "target/release/patchlock",
        help="[default: target/release/patchlock]",
    )
    shared.add_argument(
        "--venv", type=Path, default=ROOT / "target/speed-venv", help="environment for SPAMS and matplotlib"
    )
    runs = commands.add_parser("runs", parents=[shared], help="whole runs compared with other trackers")
    runs.add_argument(
        "--sequences",
        type=peers.words,
        default=["David", "Crossing", "CarScale"],
        help="by name, separated by commas [default: David,Crossing,CarScale]",
    )
    runs.add_argument(
        "--frames", type=peers.count, default=100, help="frames of each sequence [default: 100]"
    )
    runs.add_argument(
        "--threads", type=peers.count, default=2, help="threads of our tracker and of OpenCV [default: 2]"
    )
    runs.add_argument(
        "--somp-frame", type=peers.count, default=20, help="the frame whose codes are compared [default: 20]"
    )
    runs.add_argument(
        "--somp-particles",
        type=peers.count,
        default=20,
        help="number of its particles that SPAMS codes [default: 20]",
    )
    runs.add_argument(
        "--peers-venv",
        type=Path,
        default=ROOT / "target/peers-venv",
        help="environment for the other trackers",
    )
    runs.add_argument(
        "--record", type=Path, help="file for the tables as Markdown [default: only print them]"
    )
    grow = commands.add_parser("curves", parents=[shared], help="how the cost grows")
    grow.add_argument("--sequence", default="David", help="name of the sequence [default: David]")
    grow.add_argument("--frames", type=peers.count, default=30, help="number of frames [default: 30]")
    grow.add_argument(
        "--out", type=Path, required=True, help="the table goes to OUT.csv, the picture to OUT.svg"
    )
    return parser.parse_args()


def main() -> None:
    args = arguments()
    if not args.program.is_file():
        peers.fail(f"there is no program {args.program}", "build it first: cargo build --release")
    if args.command == "curves":
        curves(args)
        return
    table = whole_runs(args)
    print(table)
    if args.record:
        peers.write(args.record, record(args, table))


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--somp", folder]:
            somp_child(Path(folder))
        case ["--draw", table, picture, title]:
            draw_child(Path(table), Path(picture), title)
        case _:
            main()
