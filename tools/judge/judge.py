#!/usr/bin/env python3
"""Lets the got10k toolkit score boxes: judge.py INPUT OUTPUT.json

INPUT/truth/<target>.txt and INPUT/results/<tracker>/<target>.txt hold `x,y,w,h` a line, counted from 1. got10k's own ExperimentOTB.report
scores them, unchanged, plots and all. OUTPUT.json is what it found, curves target by target, with a header that names the versions.
"""

import json
import os
import platform
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

os.environ["MPLBACKEND"] = "Agg"  # no screen is needed

import numpy
from got10k.experiments.otb import ExperimentOTB


class Truth:
    """What got10k asks of a dataset: names of targets, and their images and boxes. Scoring needs no images."""

    def __init__(self, folder: Path):
        self.files = sorted(folder.glob("*.txt"))
        self.seq_names = [path.stem for path in self.files]

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, index: int):
        return [], numpy.loadtxt(self.files[index], delimiter=",", ndmin=2)


def main() -> None:
    source, target = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    trackers = sorted(path.name for path in (source / "results").iterdir() if path.is_dir())
    # Without the constructor, which would look for the images of all the benchmark's sequences and fetch them.
    experiment = ExperimentOTB.__new__(ExperimentOTB)
    experiment.dataset = Truth(source / "truth")
    experiment.result_dir = str(source / "results")
    experiment.nbins_iou, experiment.nbins_ce = 21, 51  # as its constructor sets them
    with tempfile.TemporaryDirectory() as reports:
        experiment.report_dir = reports
        performance = experiment.report(trackers)
    made_by = f"got10k {version('got10k')}, numpy {version('numpy')}, Python {platform.python_version()}; tools/judge/judge.py"
    header = {"made_by": made_by, "what": "ExperimentOTB.report on crates/patchlock-eval/tests/judge/made_up"}
    target.write_text(
        json.dumps({"header": header, "trackers": performance}, indent=1) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
