#!/usr/bin/env python3
"""Compares variants of the tracker: parts switched off, and other choices where the paper leaves one open.

    cargo build --release
    python3 benchmarks/variants.py ablations SEQUENCES --out results/ablations --seeds 5
    python3 benchmarks/variants.py choices SEQUENCES --out results/choices --seeds 5 --cheap

Each variant differs from the preset `paper` only in the settings below. It is run by `patchlock bench` and
scored by `patchlock score`, so the script can be interrupted and repeated. Differences smaller than the
spread over seeds are not significant. Requires only Python.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
Settings = dict[str, object]

# The paper's claims, one at a time, and settings that approximate two of the trackers on which it builds.
ABLATIONS: dict[str, Settings] = {
    "paper": {},
    "large-patches-only": {"scales": "large"},
    "small-patches-only": {"scales": "small"},
    "no-joint-sparsity": {"buffer": 0},
    "no-position-weights": {"position_weights": False},
    "no-occlusion-weights": {"occlusion_weights": False},
    "no-guards": {"delta": 0.0, "large_buffer_guard": 0.0, "small_buffer_guard": 0.0},
    # Patches of one size, each coded alone, without weights, as in ASLA (Jia, Lu, Yang, 2012). ASLA takes its
    # first templates from a nearest-neighbour tracker; these are shifts of the first box, as in the preset.
    "like-asla": {
        "scales": "large",
        "buffer": 0,
        "gamma": "one",
        "position_weights": False,
        "occlusion_weights": False,
    },
    # The whole template as one patch, weighted by its reconstruction error (after Ross et al., 2008).
    "like-ivt": {"scales": "large", "large_patch": 32, "large_step": 32, "buffer": 0, "gamma": "exp_error"},
}

CHOICES: dict[str, Settings] = {
    "paper": {},
    "gamma-one": {"gamma": "one"},
    "gamma-visible": {"gamma": "visible"},
    "gamma-exp-error": {"gamma": "exp_error"},
    "epsilon-0.04": {"epsilon": 0.04},
    "epsilon-0.13": {"epsilon": 0.13},
    "no-guided-filter": {"guided_radius": 0},
    "replace-any": {"replacement_growth": 1.0},
    "small-every-5": {"small_update_interval": 5},
    "delta-0.3": {"delta": 0.3},
    "delta-0.6": {"delta": 0.6},
    "buffers-guarded-more": {"large_buffer_guard": 0.6, "small_buffer_guard": 0.3},
}

# More than one choice at a time.
COMBINATIONS: dict[str, Settings] = {
    "paper": {},
    "gamma-one-delta-0.3": {"gamma": "one", "delta": 0.3},
}

SETS = {"ablations": ABLATIONS, "choices": CHOICES, "combinations": COMBINATIONS}

# A twelfth of the cost, for a quick comparison.
CHEAP: Settings = {"small_step": 4, "particles": 400}


def toml(settings: Settings) -> str:
    return "".join(f"{name} = {json.dumps(value)}\n" for name, value in settings.items())


def call(program: Path, *words: object) -> str:
    result = subprocess.run([program, *map(str, words)], stdout=subprocess.PIPE, text=True)
    if result.returncode:
        sys.exit(
            f"error: `{program.name} {words[0]}` exited with code {result.returncode}; its output is above"
        )
    return result.stdout


def run(name: str, settings: Settings, args: argparse.Namespace) -> None:
    folder = args.out / "settings"
    folder.mkdir(parents=True, exist_ok=True)
    config = folder / f"{name}.toml"
    config.write_text(toml({**(CHEAP if args.cheap else {}), **settings}))
    words = ["bench", args.sequences_folder, "--preset", "paper", "--config", config]
    words += ["--name", name, "--out", args.out / "runs", "--seeds", args.seeds, "--jobs", args.jobs]
    words += ["--sequences", args.sequences] if args.sequences else []
    call(args.program, *words)


def table(args: argparse.Namespace, names: list[str]) -> str:
    folders = [args.out / "runs" / name for name in names]
    words = ["score", *folders, "--truth", args.sequences_folder, "--json"]
    trackers = {t["name"]: t for t in json.loads(call(args.program, *words))["trackers"]}
    lines = ["| variant | DP | sd | AUC | sd |", "|---|---|---|---|---|"]
    for name in names:
        t = trackers[name]
        spread = [f"{t[key]:.3f}" if t[key] is not None else "-" for key in ("dp20_sd", "auc_sd")]
        lines.append(f"| {name} | {t['dp20']:.3f} | {spread[0]} | {t['auc']:.3f} | {spread[1]} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("set", choices=SETS, help="which variants")
    parser.add_argument(
        "sequences_folder", type=Path, metavar="SEQUENCES", help="a dataset, as patchlock bench takes it"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for settings and runs")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--sequences", help="only these targets, separated by commas")
    parser.add_argument("--variants", help="only these variants, separated by commas")
    parser.add_argument(
        "--cheap",
        action="store_true",
        help="small patches 4 samples apart and 400 particles, for a quick comparison",
    )
    parser.add_argument("--jobs", type=int, default=1, help="parallel runs")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/patchlock")
    args = parser.parse_args()
    variants = SETS[args.set]
    names = args.variants.split(",") if args.variants else list(variants)
    if unknown := [name for name in names if name not in variants]:
        parser.error(f"no variant {', '.join(unknown)}; there are {', '.join(variants)}")
    for name in names:
        run(name, variants[name], args)
    print(table(args, names))


if __name__ == "__main__":
    main()
