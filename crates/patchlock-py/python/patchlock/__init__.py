"""Patchlock: draw a box around anything in a video; get its track, how sure that is, and which parts are hidden.

Begin with `track` for a video, a folder or any frames at hand, or with `Tracker` to give frames one by one.
"""

from patchlock._patchlock import PRESETS, Estimate, Frames, Scene, Tracker, __version__
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
    "Occlusion",
    "Parameter",
    "Scene",
    "Settings",
    "Tracker",
    "Visibility",
    "__version__",
    "parameters",
    "to_dataframe",
    "track",
]
