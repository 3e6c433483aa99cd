#!/usr/bin/env python3
"""Compares settings of the tracker over several datasets, quickly: for trying ideas.

    cargo build --release
    python3 benchmarks/ablate.py OTB MINE --out results/tried --jobs 2 \\
        --variant robust \\
        --variant wide search=6
    python3 benchmarks/ablate.py OTB MINE --out results/tried --variants tried.toml --targets
    python3 benchmarks/ablate.py OTB MINE --out results/parts --variants benchmarks/parts.toml \\
        --over search=4.7,5,5.3

Each DATASET is a folder as `patchlock bench` takes it. A variant is a name and the settings in which it
differs from a preset (`patchlock config` lists all settings). Two words are not settings: `preset`, the
preset to start from (default: that of --preset), and `program`, another build of patchlock. In a file of
variants, each variant is a table:

    [robust]
    [wide]
    search = 6.0
    [fast]
    preset = "fast"

The table has a row for each dataset and variant: AUC, DP (precision at 20 pixels), the share of frames in
which the target is lost, the mean overlap of the other frames, the speed of the median frame, and the
differences in AUC and DP to the first variant. All but the speed are means over targets and seeds;
METHODOLOGY.md has the formulas. Differences smaller than the spread over seeds mean nothing. --over KEY=A,B,C
runs each variant with each of these values of a setting that should not matter much, and prints the means,
with the standard deviation of the AUC: where nothing is random, that is the spread. Speeds are given only for
runs made with --jobs 1, and mean something only on a machine that does nothing else. --status adds what the
tracker's own status and score are worth, --targets the AUC of each target.

Results are kept in --out, one folder for each combination of program, preset and settings, so a repeated or
interrupted call runs only what is missing. A rebuilt program is another program, because the tracker may have
changed; with --build NAME, results are kept under that name instead of under the hash of the program.
Requires only Python 3.11 or newer.
"""

import argparse
import hashlib
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
Value = str | int | float | bool
Number = float | None
# The measures of the tables: title, name in the JSON of `patchlock score`, digits.
MEASURES = [("AUC", "auc"), ("DP", "dp20"), ("lost", "lost_share"), ("not lost", "overlap_not_lost")]
COMPARED = MEASURES[:2]
# Those of --status: what the tracker says of itself, beside the truth.
SAID = [
    ("lost prec.", "status.lost_precision"),
    ("lost recall", "status.lost_recall"),
    ("false lost", "status.false_lost"),
    ("recoveries", "status.recoveries"),
    ("ECE", "calibration.ece"),
    ("AUROC", "calibration.auroc"),
]


@dataclass
class Variant:
    """A program with settings."""

    name: str
    program: Path
    preset: str
    settings: dict[str, Value]
    folder: str  # name of its folders, which is unique for program, preset and settings


# --- Variants ----------------------------------------------------------------


def value_of(text: str) -> Value:
    """A setting's value from the command line: as TOML reads it, or else a word."""
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
    return value if isinstance(value, Value) else text


def from_command_line(words: list[str], parser: argparse.ArgumentParser) -> tuple[str, dict[str, Value]]:
    name, *pairs = words
    if "=" in name:
        parser.error(f"--variant {name}: the first word is the variant's name, without =")
    for pair in pairs:
        if "=" not in pair:
            parser.error(f"--variant {name}: {pair} is not of the form key=value")
    return name, {key: value_of(value) for key, value in (pair.split("=", 1) for pair in pairs)}


def from_file(path: Path, parser: argparse.ArgumentParser) -> list[tuple[str, dict[str, Value]]]:
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        parser.error(f"--variants {path}: {error}")
    for name, table in tables.items():
        if not isinstance(table, dict):
            parser.error(f"--variants {path}: {name} is not a table; each variant is one, such as [{name}]")
        for key, value in table.items():
            if not isinstance(value, Value):
                parser.error(f"--variants {path}: {key} of {name} is not a number, word, true or false")
    return list(tables.items())


def values_of(over: str | None, parser: argparse.ArgumentParser) -> list[dict[str, Value]]:
    """The settings of --over, one after the other; without it, nothing once."""
    if over is None:
        return [{}]
    key, equals, values = over.partition("=")
    if not (key and equals and values):
        parser.error(f"--over {over}: not of the form key=value,value,...")
    return [{key: value_of(value)} for value in values.split(",")]


def variants_of(args: argparse.Namespace, parser: argparse.ArgumentParser) -> list[list[Variant]]:
    named = from_file(args.variants, parser) if args.variants else []
    named += [from_command_line(words, parser) for words in args.variant]
    if not named:
        parser.error("no variant: give --variant NAME key=value ... or --variants FILE.toml")
    for name in (names := [name for name, _ in named]):
        if names.count(name) > 1:
            parser.error(f"two variants have the name {name}")
        if not name or name.startswith(".") or "/" in name or "\\" in name:
            parser.error(f'"{name}" cannot be the name of a folder')
    values = values_of(args.over, parser)
    return [
        [variant_of(name, {**settings, **value}, args, parser) for value in values]
        for name, settings in named
    ]


def variant_of(
    name: str, settings: dict[str, Value], args: argparse.Namespace, parser: argparse.ArgumentParser
) -> Variant:
    program = Path(str(settings.pop("program", args.program)))
    preset = str(settings.pop("preset", args.preset))
    try:
        build = args.build or hashlib.sha256(program.read_bytes()).hexdigest()
    except OSError as error:
        parser.error(f"the program {program} cannot be read ({error.strerror}): cargo build --release")
    key = hashlib.sha256(json.dumps([build, preset, settings], sort_keys=True).encode()).hexdigest()
    return Variant(name, program.resolve(), preset, settings, f"{preset}-{key[:12]}")


# --- Runs --------------------------------------------------------------------


def call(program: Path, *words: object, notes: bool, fine: tuple[int, ...] = (0,)) -> str:
    """Runs the program and returns its output; ends with its error if its exit code is not fine."""
    command = [program, *map(str, words)]
    errors = None if notes else subprocess.PIPE
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=errors, text=True)
    if result.returncode not in fine:
        failed = f"error: `{program.name} {words[0]}` failed with code {result.returncode}"
        sys.exit((result.stderr or "") + failed)
    return result.stdout


def plain(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter not in "-_.")


def choose_targets(args: argparse.Namespace) -> dict[Path, list[str]]:
    """The targets of each dataset, or those that --sequences names, without datasets that have none."""
    asked = {plain(name): name for name in args.sequences.split(",")} if args.sequences else {}
    chosen, found = {}, set()
    for dataset in args.datasets:
        # Code 1 says that something is unusual; bench reports what it cannot use.
        listed = call(args.program, "dataset", dataset, "--json", notes=False, fine=(0, 1))
        for target in (target["name"] for target in json.loads(listed)["targets"]):
            # `Jogging` asks for all targets of this sequence: Jogging.1 and Jogging.2.
            names = {plain(target), plain(target.rpartition(".")[0])} & set(asked)
            found |= names
            if names or not asked:
                chosen.setdefault(dataset, []).append(target)
    if missing := [name for key, name in asked.items() if key not in found]:
        sys.exit(f"error: --sequences: no dataset has a target {', '.join(missing)}")
    return chosen


def first_seed(variant: Variant) -> int:
    return int(variant.settings.get("seed", 0))


def run(variant: Variant, dataset: Path, targets: list[str], args: argparse.Namespace) -> Path:
    """Makes the runs that are missing, and returns the folder of all runs of the variant on the dataset."""
    out = args.out / dataset.resolve().name
    out.mkdir(parents=True, exist_ok=True)
    config = out / f"{variant.folder}.toml"
    lines = [f"{name} = {json.dumps(value)}\n" for name, value in variant.settings.items()]
    config.write_text("".join(lines), encoding="utf-8")
    words = ["bench", dataset, "--out", out, "--name", variant.folder, "--preset", variant.preset]
    words += ["--config", config, "--seeds", args.seeds, "--jobs", args.jobs]
    words += ["--sequences", ",".join(targets)]
    print(f"{variant.name} on {out.name}", file=sys.stderr)
    call(variant.program, *words, notes=True)
    return out / variant.folder


def copy_runs(folder: Path, seeds: range, targets: list[str], copy: Path) -> list[dict]:
    """Copies the runs that are asked for, since the folder may hold more, and returns their manifests."""
    copy.mkdir(parents=True)
    shutil.copy(folder / "manifest.json", copy)
    manifests = []
    for file in sorted(folder.glob("ope/*/*.json")):
        if int(file.stem) in seeds and file.parent.name in targets:
            target = copy / "ope" / file.parent.name
            target.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, target)
            shutil.copy(file.with_suffix(".txt"), target)
            manifests.append(json.loads(file.read_text(encoding="utf-8")))
    return manifests


def median_fps(manifests: list[dict]) -> Number:
    """Frames per second of the median frame; None if runs were made in parallel."""
    if any(manifest["jobs"] > 1 for manifest in manifests):
        return None
    seconds = [second for manifest in manifests for second in manifest["seconds"]]
    return 1 / statistics.median(seconds) if seconds and statistics.median(seconds) > 0 else None


def scores(
    variants: list[list[Variant]], dataset: Path, targets: list[str], args: argparse.Namespace
) -> list[dict]:
    """What `patchlock score` says of each variant on the dataset, with the median speed, as means over the
    values of --over."""
    values = len(variants[0])
    each = scores_of([one for variant in variants for one in variant], dataset, targets, args)
    return [mean_of(each[k : k + values]) for k in range(0, len(each), values)]


def mean_of(parts: list) -> object:
    """The mean of numbers, and of the numbers in objects; None where one is missing, and of what is not a
    number the first. Where there are several objects, they get the spread of their AUC."""
    first = parts[0]
    if isinstance(first, dict):
        mean = {key: mean_of([part.get(key) for part in parts]) for key in first}
        if len(parts) > 1 and isinstance(first.get("auc"), float):
            mean["auc_spread"] = statistics.stdev(part["auc"] for part in parts)
        return mean
    if None in parts or not isinstance(first, int | float):
        return None if None in parts else first
    return first if len(set(parts)) == 1 else statistics.mean(parts)


def scores_of(
    variants: list[Variant], dataset: Path, targets: list[str], args: argparse.Namespace
) -> list[dict]:
    """What `patchlock score` says of each variant on the dataset, with the median speed."""
    with tempfile.TemporaryDirectory() as temporary:
        copies, speeds = [], []
        for k, variant in enumerate(variants):
            folder = run(variant, dataset, targets, args)
            copies.append(Path(temporary) / str(k))
            seeds = range(first_seed(variant), first_seed(variant) + args.seeds)
            speeds.append(median_fps(copy_runs(folder, seeds, targets, copies[-1])))
        words = ["score", *copies, "--truth", dataset, "--by", "target", "--json"]
        # One program scores all, by the same formulas. Its notes are about targets that were not asked for.
        trackers = json.loads(call(variants[0].program, *words, notes=False))["trackers"]
    return [{**tracker, "fps": fps} for tracker, fps in zip(trackers, speeds, strict=True)]


# --- Tables ------------------------------------------------------------------


def shown(value: Number, digits: int = 3, sign: str = "") -> str:
    return "-" if value is None else f"{value:{sign}.{digits}f}"


def number_at(score: dict, path: str) -> Number:
    """A number of the JSON by its names from outside to inside; None where one is missing or null."""
    for name in path.split("."):
        score = (score or {}).get(name)
    return score


def difference(value: Number, other: Number) -> Number:
    return None if value is None or other is None else value - other


def aligned(rows: list[list[str]]) -> str:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    numbers = [all(row[k][:1] in "-+0123456789" for row in rows[1:]) for k in range(len(rows[0]))]
    lines = [
        "  ".join(
            cell.rjust(width) if is_number else cell.ljust(width)
            for cell, width, is_number in zip(row, widths, numbers)
        )
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def head_of(dataset: Path, variant: Variant, own: dict) -> list[str]:
    return [dataset.resolve().name, str(own["targets"]), str(own["seeds"]), variant.name]


def said_of(dataset: Path, variants: list[Variant], score: list[dict]) -> list[list[str]]:
    return [
        head_of(dataset, variant, own) + [shown(number_at(own, path)) for _, path in SAID]
        for variant, own in zip(variants, score)
    ]


def rows_of(dataset: Path, variants: list[Variant], score: list[dict]) -> list[list[str]]:
    rows = []
    for variant, own in zip(variants, score):
        row = head_of(dataset, variant, own)
        row += [shown(own[key]) for _, key in MEASURES] + [shown(own["fps"], 1)]
        row += [shown(own["auc_spread"])] if "auc_spread" in own else []
        row += [shown(difference(own[key], score[0][key]), sign="+") for _, key in COMPARED]
        rows.append(row)
    return rows


def targets_of(dataset: Path, variants: list[Variant], score: list[dict]) -> list[list[str]]:
    """AUC per target; after the first variant's, each with its difference to the first."""
    rows = [[f"AUC in {dataset.resolve().name}", variants[0].name]]
    rows[0] += [word for variant in variants[1:] for word in (variant.name, "diff")]
    for target, first in score[0]["by_target"].items():
        row = [target, shown(first["auc"])]
        for other in score[1:]:
            auc = other["by_target"].get(target, {}).get("auc")
            row += [shown(auc), shown(difference(auc, first["auc"]), sign="+")]
        rows.append(row)
    return rows


def arguments() -> tuple[argparse.Namespace, argparse.ArgumentParser]:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("datasets", type=Path, nargs="+", metavar="DATASET", help="before the variants")
    parser.add_argument("--out", type=Path, required=True, help="folder for settings and runs")
    parser.add_argument(
        "--variant", nargs="+", action="append", default=[], metavar=("NAME", "KEY=VALUE"), help="a variant"
    )
    parser.add_argument("--variants", type=Path, metavar="FILE.toml", help="variants, before those above")
    parser.add_argument("--over", metavar="KEY=A,B,C", help="run each variant with each of these values")
    parser.add_argument("--preset", default="robust", help="the preset to start from (default: robust)")
    parser.add_argument("--seeds", type=int, default=1, help="runs of each target (default: 1)")
    parser.add_argument("--sequences", metavar="A,B", help="only these targets, in datasets that have them")
    parser.add_argument("--jobs", type=int, default=1, help="parallel runs; without speeds if more than 1")
    parser.add_argument("--targets", action="store_true", help="also print the AUC of each target")
    parser.add_argument("--status", action="store_true", help="also print what status and score are worth")
    parser.add_argument("--build", metavar="NAME", help="name of the results, not the program's hash")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/patchlock")
    return parser.parse_args(), parser


def main() -> None:
    args, parser = arguments()
    variants = variants_of(args, parser)
    firsts = [variant[0] for variant in variants]
    names = [dataset.resolve().name for dataset in args.datasets]
    if len(set(names)) < len(names):
        parser.error("two datasets have folders of the same name, which is that of their results")
    head = ["dataset", "targets", "seeds", "variant"]
    diffs = [f"{title} diff" for title, _ in COMPARED]
    spread = ["AUC sd"] if len(variants[0]) > 1 else []
    table = [head + [title for title, _ in MEASURES] + ["fps"] + spread + diffs]
    said = [head + [title for title, _ in SAID]]
    parts = []
    for dataset, targets in choose_targets(args).items():
        score = scores(variants, dataset, targets, args)
        table += rows_of(dataset, firsts, score)
        said += said_of(dataset, firsts, score)
        parts += ["\n" + aligned(targets_of(dataset, firsts, score))] if args.targets else []
    parts = ["\n" + aligned(said), *parts] if args.status else parts
    print(aligned(table) + "".join(parts), end="")


if __name__ == "__main__":
    main()
