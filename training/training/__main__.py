"""`python -m training fetch | pairs | train | export | judge`."""

import argparse
import csv
import sys
from pathlib import Path


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m training", description=__doc__)
    parser.add_argument("--work", type=Path, default=Path("work"), help="folder of all data")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("fetch", help="download and unpack the packages of sources.csv")
    commands.add_parser("pairs", help="make the store of pairs, and a sheet to look at")
    trained = commands.add_parser("train", help="train, or go on with a run that was stopped")
    trained.add_argument("--run", default="run", help="name of the run's folder below WORK")
    trained.add_argument("--seed", type=int, default=1)
    trained.add_argument("--steps", type=int, default=12000)
    trained.add_argument("--threads", type=int, default=1, help="threads of the trainer")
    trained.add_argument("--makers", type=int, default=1, help="processes that make pairs")
    trained.add_argument("--rate", type=float, default=2e-3, help="the highest rate")
    trained.add_argument("--start", type=Path, help="folder of exported weights to begin with")
    exported = commands.add_parser(
        "export", help="write patchnet_backbone.onnx and patchnet_head.onnx"
    )
    exported.add_argument("weights", type=Path, help="a file step-NNNNNN.pt of a run")
    exported.add_argument("folder", type=Path)
    judged = commands.add_parser("judge", help="follow the targets of development sets")
    judged.add_argument("folder", type=Path, help="folder with backbone.onnx and head.onnx")
    judged.add_argument("--data", type=Path, help="folder of the sets [default: PATCHLOCK_DATA]")
    judged.add_argument("--only", nargs="+", help="names of targets")
    judged.add_argument("--save", type=Path, help="CSV for the figures")
    options = parser.parse_args(arguments)
    try:
        CALLS[options.command](options)
    except (ValueError, FileNotFoundError) as error:
        sys.exit(f"error: {error}")


def fetch(options):
    from . import sources

    options.work.mkdir(parents=True, exist_ok=True)
    sources.fetch(options.work.resolve())


def pairs(options):
    from . import sheet, store

    sheet.write(store.build(options.work), options.work / "pairs.png")


def train(options):
    from . import train as training

    settings = training.Settings(seed=options.seed, steps=options.steps, rate=options.rate)
    run = options.work / options.run
    training.train(options.work, run, settings, options.threads, options.makers, options.start)


def export(options):
    from . import export as exporting

    for path in exporting.export(exporting.network_of(options.weights), options.folder):
        print(f"{path} {path.stat().st_size} bytes")


def judge(options):
    from . import judge as judging

    data = options.data or judging.default_data()
    found = judging.judge(options.folder, data, options.only)
    every = [value for values in found.values() for value in values.values()]
    for group, values in found.items():
        print(f"{group} {len(values)} {sum(values.values()) / len(values):.3f}")
    print(f"all {len(every)} {sum(every) / len(every):.3f}")
    if not options.only:
        hits, overlap = judging.single_looks(options.folder, data)
        print(f"single looks: hits {hits:.3f}, overlap {overlap:.3f}")
    if options.save:
        with options.save.open("w", newline="") as file:
            rows = [(g, n, f"{v:.4f}") for g, values in found.items() for n, v in values.items()]
            csv.writer(file).writerows([("set", "target", "auc"), *rows])


CALLS = {"fetch": fetch, "pairs": pairs, "train": train, "export": export, "judge": judge}

if __name__ == "__main__":
    main()
