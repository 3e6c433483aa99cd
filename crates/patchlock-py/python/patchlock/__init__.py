"""Patchlock: draw a box around anything in a video; get its track, how sure that is, and which parts are hidden.

Begin with `track` for a video, a folder or any frames at hand, or with `Tracker` to give frames one by one; `MultiTracker` follows many targets,
and `export` writes tracks for other tools.
"""

from patchlock import rerun
from patchlock._export import export
from patchlock._patchlock import PRESETS, Estimate, Frames, MultiTracker, Observation, Scene, Tracker, __version__
from patchlock._settings import Settings, parameters
from patchlock._track import to_dataframe, track
from patchlock._types import Box, BoxLike, FrameLike, Occlusion, Parameter, Visibility

__all__ = [
    "PRESETS",
    "Box",
    "BoxLike",
    "Estimate",
    "FrameLike",
    "Frames",
    "MultiTracker",
    "Observation",
    "Occlusion",
    "Parameter",
    "Scene",
    "Settings",
    "Tracker",
    "Visibility",
    "__version__",
    "export",
    "parameters",
    "rerun",
    "to_dataframe",
    "track",
]
