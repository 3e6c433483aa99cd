"""Many clips: each tracked by a process of its own, on this machine or on a cluster, and kept as `patchlock bench` keeps runs.

`run` takes a manifest of clips, `bench` a benchmark's dataset. The command is `python -m patchlock.batch`.
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
