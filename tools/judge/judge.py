#!/usr/bin/env python3
"""Scores boxes with the got10k toolkit: judge.py INPUT OUTPUT.json

INPUT/truth/<target>.txt and INPUT/results/<tracker>/<target>.txt have `x,y,w,h` per line, counted from 1.
They are scored by the unchanged ExperimentOTB.report of got10k. OUTPUT.json holds its scores, with the curves
of each target, and a header with the versions.
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
    """The interface that got10k requires of a dataset: names, images and boxes. Scoring needs no images."""

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
    # Skips the constructor, which would download the images of all sequences of OTB.
    experiment = ExperimentOTB.__new__(ExperimentOTB)
    experiment.dataset = Truth(source / "truth")
    experiment.result_dir = str(source / "results")
    experiment.nbins_iou, experiment.nbins_ce = 21, 51  # as its constructor sets them
    with tempfile.TemporaryDirectory() as reports:
        experiment.report_dir = reports
        performance = experiment.report(trackers)
    made_by = (
        f"got10k {version('got10k')}, numpy {version('numpy')}, Python {platform.python_version()}; "
        "tools/judge/judge.py"
    )
    header = {"made_by": made_by, "what": "ExperimentOTB.report on crates/patchlock-bench/tests/judge/made_up"}
    target.write_text(
        json.dumps({"header": header, "trackers": performance}, indent=1) + "\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
