"""Patchlock, a visual object tracker.

Draw a box around anything in a video; Patchlock finds it in the other frames and reports how certain each box
is and which parts of the target are hidden.

`track` tracks through a video, a folder of images or any sequence of frames. `Tracker` takes frames one by
one. `MultiTracker` follows many targets. `export` writes tracks in the formats of other tools.
"""

from patchlock import rerun
from patchlock._export import export
from patchlock._patchlock import (
    PRESETS,
    Estimate,
    Frames,
    MultiTracker,
    Observation,
    RobustObservation,
    Scene,
    Tracker,
    __version__,
)
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
    "RobustObservation",
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
