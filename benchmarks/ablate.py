#!/usr/bin/env python3
"""Tells whether a change of the tracker is a gain, over the segments of many targets.

    cargo build --release
    python3 benchmarks/segments.py OTB --out segments/OTB
    python3 benchmarks/segments.py MINE --out segments/MINE
    python3 benchmarks/ablate.py segments/OTB segments/MINE --out results/tried \\
        --variant robust \\
        --variant wide search=6 \\
        --variant code program=OTHER/target/release/patchlock
    python3 benchmarks/ablate.py segments/*/ --out results/parts --variants benchmarks/parts.toml

Each DATASET is a folder that segments.py made, with or without --whole and --frames. The first variant is the
baseline. A variant is a name and the settings in which it differs from a preset (`patchlock config --research`
lists all). Three words are not settings: `preset`, the preset to start from (default: that of --preset);
`program`, another build of patchlock; `results`, a folder with results that `bench` or peers.py wrote, where
{set} stands for the name of a DATASET: `results=out/{set}/csrt`. In a file of variants, each variant is a
table:

    [robust]
    [wide]
    search = 6.0
    [paper]
    preset = "paper"

Of each variant the tables show the mean AUC and DP (precision at 20 pixels) over targets and their paired
differences to the baseline, as `difference ± standard error (check)`: by bootstrap over targets, and by
s / sqrt(n). A target is the mean over its segments. "Tuning" is a fixed half of the targets, by a hash of
their names; settings are chosen on this half only, and "other" shows what they are worth elsewhere. The
verdict is `gain` if the difference in AUC over all targets is above its standard error and no set loses more
than .01, and otherwise `no`. Further tables have the differences by set, by attribute (those of OTB, and of
attributes.csv in or beside a DATASET, with names of targets), and for lost and kept segments, and what status
and score are worth. METHODOLOGY.md has the formulas. --json FILE has all numbers, also of each target.

Results are kept in --out, one folder for each combination of program, preset and settings, so a repeated or
interrupted call runs only what is missing. A rebuilt program is another program, because the tracker may have
changed; with --build NAME, results are kept under that name instead of under the hash of the program. Speeds
are of the median frame; they are given only for runs made with --jobs 1, and mean something only on a machine
that does nothing else. Requires only Python 3.11 or newer.
"""

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

import paired
from segments import SEGMENTS, STARTS

ROOT = Path(__file__).resolve().parent.parent
Value = str | int | float | bool
# The names of the sequences that segments.py makes of a target.
NAMES = {name for name, *_ in [*SEGMENTS, *STARTS]}
# Settings that name files. A settings file may be elsewhere.
FILES = ("model", "runtime")


@dataclass
class Variant:
    """A program with settings, or results."""

    name: str
    program: Path
    preset: str
    settings: dict[str, Value]
    results: str | None  # where results are already
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


def variants_of(args: argparse.Namespace, parser: argparse.ArgumentParser) -> list[Variant]:
    named = from_file(args.variants, parser) if args.variants else []
    named += [from_command_line(words, parser) for words in args.variant]
    if not named:
        parser.error("no variant: give --variant NAME key=value ... or --variants FILE.toml")
    for name in (names := [name for name, _ in named]):
        if names.count(name) > 1:
            parser.error(f"two variants have the name {name}")
    return [variant_of(name, dict(settings), args, parser) for name, settings in named]


def variant_of(
    name: str, settings: dict[str, Value], args: argparse.Namespace, parser: argparse.ArgumentParser
) -> Variant:
    program = Path(str(settings.pop("program", args.program)))
    preset = str(settings.pop("preset", args.preset))
    results = settings.pop("results", None)
    if results is not None:
        if settings:
            parser.error(f"{name}: results exist already, so they cannot have other settings")
        return Variant(name, program, preset, {}, str(results), "")
    files = [key for key in FILES if settings.get(key, "none") not in ("patchnet", "none")]
    settings |= {key: str(Path(str(settings[key])).resolve()) for key in files}
    try:
        build = args.build or hashlib.sha256(program.read_bytes()).hexdigest()
    except OSError as error:
        parser.error(f"the program {program} cannot be read ({error.strerror}): cargo build --release")
    key = hashlib.sha256(json.dumps([build, preset, settings], sort_keys=True).encode()).hexdigest()
    return Variant(name, program.resolve(), preset, settings, None, f"{preset}-{key[:12]}")


# --- Targets -----------------------------------------------------------------


def attributes_of(dataset: Path, names: list[str], program: Path) -> dict[str, list[str]]:
    """The attributes of targets, as the program reads them for a dataset with these targets."""
    with tempfile.TemporaryDirectory() as temporary:
        for name in names:
            (Path(temporary) / f"{name}.txt").write_text("1,1,9,9\n", encoding="utf-8")
        tables = [folder / "attributes.csv" for folder in (dataset, dataset.resolve().parent)]
        for table in [table for table in tables if table.is_file()][:1]:
            shutil.copy(table, temporary)
        listed = call(program, "dataset", temporary, "--json", notes=False, fine=(0, 1))
    return {target["name"]: target["attributes"] for target in json.loads(listed)["targets"]}


def segments_of(dataset: Path) -> dict[str, list[str]]:
    """The names of the segments of each target, in a folder that segments.py made."""
    segments: dict[str, list[str]] = {}
    for folder in sorted(dataset.glob("*/groundtruth_rect.txt")):
        target, dash, segment = folder.parent.name.rpartition("-")
        if segment not in NAMES or not dash:
            sys.exit(f"error: {folder.parent}: is not a segment; segments.py makes them")
        segments.setdefault(target, []).append(folder.parent.name)
    if not segments:
        sys.exit(f"error: {dataset}: has no segments; segments.py makes them")
    return segments


def targets_of(dataset: Path, only: str | None, program: Path) -> list[paired.Target]:
    """The targets of a folder that segments.py made, or those of --only that it has."""
    segments = segments_of(dataset)
    wanted = only.lower().split(",") if only else [name.lower() for name in segments]
    names = [name for name in segments if name.lower() in wanted]
    attributes = attributes_of(dataset, names, program) if names else {}
    return [
        paired.Target(dataset.resolve().name, name, attributes.get(name, []), segments[name])
        for name in names
    ]


def choose_targets(args: argparse.Namespace) -> dict[Path, list[paired.Target]]:
    chosen = {dataset: targets_of(dataset, args.only, args.program) for dataset in args.datasets}
    found = {target.name.lower() for targets in chosen.values() for target in targets}
    if missing := [name for name in (args.only or "").split(",") if name and name.lower() not in found]:
        sys.exit(f"error: --only: no dataset has a target {', '.join(missing)}")
    return {dataset: targets for dataset, targets in chosen.items() if targets}


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


def run(variant: Variant, dataset: Path, segments: list[str], args: argparse.Namespace) -> Path:
    """Makes the runs that are missing, and returns the folder of all runs of the variant on the dataset."""
    if variant.results is not None:
        return Path(variant.results.replace("{set}", dataset.resolve().name))
    out = args.out / dataset.resolve().name
    out.mkdir(parents=True, exist_ok=True)
    config = out / f"{variant.folder}.toml"
    lines = [f"{name} = {json.dumps(value)}\n" for name, value in variant.settings.items()]
    config.write_text("".join(lines), encoding="utf-8")
    words = ["bench", dataset, "--out", out, "--name", variant.folder, "--preset", variant.preset]
    words += ["--config", config, "--seeds", args.seeds, "--jobs", args.jobs]
    words += ["--sequences", ",".join(segments)]
    print(f"{variant.name} on {out.name}", file=sys.stderr)
    call(variant.program, *words, notes=True)
    return out / variant.folder


def runs_of(
    variant: Variant, chosen: dict[Path, list[paired.Target]], args: argparse.Namespace
) -> paired.Runs:
    """All runs of the variant, in the order of the targets."""
    runs = []
    for dataset, targets in chosen.items():
        folder = run(variant, dataset, [name for target in targets for name in target.segments], args)
        for target in targets:
            runs.append(
                [
                    read
                    for segment in target.segments
                    for read in read_segment(folder / "ope" / segment, dataset / segment, variant, args)
                ]
            )
    return runs


def read_segment(
    folder: Path, sequence: Path, variant: Variant, args: argparse.Namespace
) -> list[paired.Run]:
    """The runs of a segment, one for each seed."""
    first = int(variant.settings.get("seed", 0))
    files = [folder / f"{seed}.txt" for seed in range(first, first + args.seeds)]
    if lacking := [file for file in files if not file.is_file()]:
        sys.exit(f"error: {variant.name}: there is no {lacking[0]}")
    truth = paired.boxes(sequence / "groundtruth_rect.txt")
    return [paired.read_run(file, sequence.name.rpartition("-")[2], truth) for file in files]


# --- Tables ------------------------------------------------------------------


def shown(value: paired.Number, sign: str = "") -> str:
    """A number without the zero before the point."""
    return "-" if value is None else re.sub(r"^([+-]?)0\.", r"\1.", f"{value:{sign}.3f}")


def change(one: dict[str, paired.Number]) -> str:
    if one["difference"] is None:
        return "-"
    return f"{shown(one['difference'], '+')} ± {shown(one['error'])} ({shown(one['plain_error'])})"


def row_of(parts: list[str]) -> str:
    return f"| {' | '.join(parts)} |\n"


def table(title: str, head: list[str], rows: list[list[str]]) -> str:
    return f"## {title}\n\n{row_of(head)}{row_of(['---'] * len(head))}{''.join(map(row_of, rows))}\n"


def sizes(by_part: dict[str, dict], key: str) -> str:
    """The number of all, and those of the halves."""
    return f"{by_part['all'][key]} ({by_part['tuning'][key]} + {by_part['other'][key]})"


def values(by_part: dict[str, dict], key: str) -> str:
    """The number for all, and those for the halves."""
    total, tuning, other = (shown(by_part[part][key]) for part in paired.PARTS)
    return f"{total} ({tuning}, {other})"


CHANGES = [
    cell
    for measure in ("AUC", "DP")
    for cell in (f"{measure} (tuning, other)", f"{measure} diff", "tuning", "other")
]


def changes(measures: dict[str, dict], is_baseline: bool) -> list[str]:
    cells = []
    for parts in (measures["auc"], measures["dp"]):
        cells.append(values(parts, "value"))
        cells += ["" if is_baseline else change(parts[part]) for part in paired.PARTS]
    return cells


def table_of_all(variants: dict[str, dict]) -> str:
    rows = []
    for k, (name, one) in enumerate(variants.items()):
        fps = "-" if one["fps"] is None else f"{one['fps']:.0f}"
        rows.append([name, *changes(one["all"], k == 0), fps, one["verdict"] if k else ""])
    targets = sizes(next(iter(variants.values()))["all"]["auc"], "targets")
    return table(f"Accuracy, {targets} targets", ["variant", *CHANGES, "fps", "verdict"], rows)


def table_of_groups(variants: dict[str, dict], title: str, key: str) -> str:
    first, rows = next(iter(variants.values()))[key], []
    for group in first:
        for k, (name, one) in enumerate(variants.items()):
            targets = sizes(one[key][group]["auc"], "targets")
            rows.append([group, targets, name, *changes(one[key][group], k == 0)])
    return table(f"By {title}", [title, "targets", "variant", *CHANGES], rows) if first else ""


def table_of_segments(variants: dict[str, dict]) -> str:
    head = ["variant", "lost frames (tuning, other)", "lost segments", "newly lost", "newly kept"]
    head += ["AUC diff, kept by both", "tuning", "other", "AUC diff, other segments", "tuning", "other"]
    rows = []
    for k, (name, one) in enumerate(variants.items()):
        parts = one["segments"]
        row = [name, values(one["all"]["lost"], "value"), sizes(parts, "lost")]
        if k == 0:
            row += [""] * 8
        else:
            row += [sizes(parts, "newly_lost"), sizes(parts, "newly_kept")]
            row += [
                change(parts[part][which])
                for which in ("auc_kept_by_both", "auc_other_segments")
                for part in paired.PARTS
            ]
        rows.append(row)
    return table(f"Lost and kept, {sizes(parts, 'segments')} runs of segments", head, rows)


PROMISES = {
    "tracked_off": "tracked that are off",
    "off_tracked": "off called tracked",
    "off_lost": "off called lost",
    "sure_missed": f"scores >= {paired.SURE} with overlap < {paired.ON}",
    "ece": "ECE",
    "auroc": "AUROC",
}


def table_of_promises(variants: dict[str, dict]) -> str:
    rows = [
        [frames, name, *(values(one[which], key) for key in PROMISES)]
        for which, frames in (("promises", "all segments"), ("promises_first", "from the first frame"))
        for name, one in variants.items()
    ]
    head = ["all frames of", "variant", *PROMISES.values()]
    return table("Status and score, both halves (tuning, other)", head, rows)


def table_of_targets(variants: dict[str, dict]) -> str:
    first, *others = variants
    head = ["target", "set", "half", f"AUC of {first}", *(f"diff of {name}" for name in others)]
    rows = []
    for k, target in enumerate(variants[first]["targets"]):
        row = [target["name"], target["set"], target["half"], shown(target["auc"])]
        for name in others:
            auc = variants[name]["targets"][k]["auc"]
            known = auc is not None and target["auc"] is not None
            row.append(shown(auc - target["auc"], "+") if known else "-")
        rows.append(row)
    return table("By target", head, rows)


def tables(variants: dict[str, dict], with_targets: bool) -> str:
    text = table_of_all(variants) + table_of_groups(variants, "set", "by_set")
    text += table_of_groups(variants, "attribute", "by_attribute")
    text += table_of_segments(variants) + table_of_promises(variants)
    return text + (table_of_targets(variants) if with_targets else "")


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
    parser.add_argument("--preset", default="robust", help="the preset to start from (default: robust)")
    parser.add_argument("--seeds", type=int, default=1, help="runs of each segment (default: 1)")
    parser.add_argument("--only", metavar="A,B", help="only these targets, in datasets that have them")
    parser.add_argument("--jobs", type=int, default=1, help="parallel runs; without speeds if more than 1")
    parser.add_argument("--targets", action="store_true", help="also print the AUC of each target")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write all numbers")
    parser.add_argument("--build", metavar="NAME", help="name of the results, not the program's hash")
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/patchlock")
    return parser.parse_args(), parser


def main() -> None:
    args, parser = arguments()
    variants = variants_of(args, parser)
    names = [dataset.resolve().name for dataset in args.datasets]
    if len(set(names)) < len(names):
        parser.error("two datasets have folders of the same name, which is that of their results")
    chosen = choose_targets(args)
    targets = [target for of_set in chosen.values() for target in of_set]
    runs = [runs_of(variant, chosen, args) for variant in variants]
    compared = {
        variant.name: {"preset": variant.preset, "settings": variant.settings, "results": variant.folder}
        | paired.compare(targets, runs[0], own)
        for variant, own in zip(variants, runs, strict=True)
    }
    if args.json:
        args.json.write_text(json.dumps(compared, indent=1) + "\n", encoding="utf-8")
    print(tables(compared, args.targets), end="")


if __name__ == "__main__":
    main()
