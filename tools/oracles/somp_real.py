"""Compares SPAMS with the numpy reference on real frames: prints how often they agree and how fast SPAMS is.

    python somp_real.py [--data FOLDER] [--problems 200] [--out FILE] [NAME ...]

FOLDER (default: $PATCHLOCK_DATA, or ../shared/data) holds sequences in the OTB layout, directly or in
subfolders: <NAME>/img/*.jpg and <NAME>/groundtruth_rect.txt with 1-based x, y, w, h.

The frames, and patches cut from them, belong to others, so nothing is written to the repository. `--out`
writes the problems elsewhere, in the format of somp.json without `random`; the solver's test can read them:

    python somp_real.py --out FILE
    PATCHLOCK_SOMP_GOLDEN=FILE cargo test -p patchlock
"""

import argparse
import os
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import spams

import golden
import patchwise
import somp
from patchwise import LARGE, SMALL, Setting

REPOSITORY = Path(__file__).resolve().parents[2]
DEFAULT_NAMES = ["CarDark", "David", "Deer"]
CANDIDATES = 10


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("PATCHLOCK_DATA", "../shared/data")))
    parser.add_argument("--problems", type=int, default=200, help="per sequence; 70 %% have small patches")
    parser.add_argument("--out", type=Path, help="outside the repository")
    parser.add_argument("names", nargs="*", default=DEFAULT_NAMES)
    args = parser.parse_args()
    if args.out and args.out.resolve().is_relative_to(REPOSITORY):
        parser.error("real data must stay outside the repository")
    return args


def find(data: Path, name: str) -> Path:
    for folder in (data / name, *sorted(data.glob(f"*/{name}"))):
        if (folder / "groundtruth_rect.txt").exists():
            return folder
    raise SystemExit(f"no sequence {name} in {data}")


def plan(rng: np.random.Generator, folder: Path, problems: int) -> list[tuple[Setting, dict]]:
    """Half of the problems use the first buffer, half a buffer of tracked patches."""
    sequence = patchwise.read_sequence(folder)
    small, large = problems * 7 // 20, problems // 2 - problems * 7 // 20
    settings = [patchwise.setting(rng, sequence, CANDIDATES, tracked) for tracked in (False, True)]
    return [(s, {SMALL: small, LARGE: large}) for s in settings]


def report(file: dict[str, Any]) -> None:
    counts = {
        key: Counter(file["settings"][r["setting"]]["name"] for r in file[key])
        for key in ("agree", "spams_degenerate")
    }
    for setting in file["settings"]:
        agree, degenerate = (counts[key][setting["name"]] for key in ("agree", "spams_degenerate"))
        print(f"{setting['name']}: {agree} agree, {degenerate} degenerate")
    for record in file["spams_degenerate"]:
        print(
            f"  {record['scale']} {record['spams']['atoms']} / {record['reference']['atoms']}: "
            f"{record['difference']}"
        )
    records = file["agree"] + file["spams_degenerate"]
    differing = sum(set(r["textbook"]["atoms"]) != set(r["reference"]["atoms"]) for r in records)
    print(f"textbook selection takes other atoms in {differing} of {len(records)}")


def time_one_particle(setting: Setting) -> float:
    """Time on one thread for the 169 small problems of one candidate, in seconds: the best of three calls."""
    dictionary = patchwise.dictionary(setting.templates, SMALL)
    signals = np.asfortranarray(np.hstack([setting.signals(SMALL, 0, i) for i in range(SMALL.locations)]))
    groups = np.arange(0, signals.shape[1], signals.shape[1] // SMALL.locations, dtype=np.int32)
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        spams.somp(signals, dictionary, groups, L=4, eps=0.0, numThreads=1)
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def main() -> None:
    args = arguments()
    rng = np.random.default_rng(6)
    plans = [p for name in args.names for p in plan(rng, find(args.data, name), args.problems)]
    file = somp.content(rng, somp.header("sequences of OTB, not to be passed on"), plans)
    report(file)
    print(
        f"SPAMS, one thread, {SMALL.locations} small problems of one particle: "
        f"{1000 * time_one_particle(plans[-1][0]):.0f} ms"
    )
    if args.out:
        golden.write(args.out.resolve(), file)


if __name__ == "__main__":
    main()
