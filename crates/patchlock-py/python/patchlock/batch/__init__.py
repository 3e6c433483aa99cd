"""Tracks many clips in parallel, on this machine or on a cluster.

Results are stored in the format of `patchlock bench`. `run` takes a manifest of clips, `bench` the dataset of
a benchmark. The command is `python -m patchlock.batch`.
"""

from patchlock.batch.engine import Engine
from patchlock.batch.local import Local
from patchlock.batch.manifest import Clip, ClipError, ManifestError, write_truth
from patchlock.batch.run import bench, run
from patchlock.batch.summary import Failure, Summary
from patchlock.batch.task import Failed, Lost, Made, Outcome

__all__ = [
    "Clip",
    "ClipError",
    "Engine",
    "Failed",
    "Failure",
    "Local",
    "Lost",
    "Made",
    "ManifestError",
    "Outcome",
    "Summary",
    "bench",
    "run",
    "write_truth",
]
