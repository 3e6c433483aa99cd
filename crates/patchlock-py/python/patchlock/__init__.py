"""Patchlock, a visual object tracker.

Draw a box around anything in a video; Patchlock finds it in the other frames and reports how certain each box
is and which parts of the target are hidden.

`track` tracks through a video, a folder of images or any sequence of frames. `Tracker` takes frames one by
one. `MultiTracker` follows many targets. `export` writes tracks in the formats of other tools.
`Project` reads and writes the annotations of `patchlock studio`.

A frame (`FrameLike`) is a numpy array of shape (height, width), grey, or (height, width, 3), colour, of
uint8, uint16 or float32; or a PIL image. float32 samples are usually from 0 to 1, but other ranges work too.
Colour is red, green, blue unless `channels="bgr"` says otherwise.

A box (`BoxLike`) is four numbers: left, top, width and height in pixels, counted from 0; fractions are
allowed.

A value that is not allowed raises `ValueError`, a value of the wrong type or an unknown setting `TypeError`,
a file that can't be read `OSError`, and `update` before `init` `RuntimeError`. The message says what is
allowed. A tracker is unchanged by a call that fails. """

from patchlock import rerun
from patchlock._export import export
from patchlock._patchlock import (
    PRESETS,
    Estimate,
    Frames,
    MultiTracker,
    Observation,
    Project,
    RobustObservation,
    Scene,
    Tracker,
    __version__,
)
from patchlock._settings import Settings, parameters
from patchlock._supervision import to_supervision
from patchlock._track import to_dataframe, track
from patchlock._types import Box, BoxLike, FrameLike, Parameter, Visibility

# Without the module `rerun`: a star import must not replace the package of that name.
__all__ = [
    "PRESETS",
    "Box",
    "BoxLike",
    "Estimate",
    "FrameLike",
    "Frames",
    "MultiTracker",
    "Observation",
    "Parameter",
    "Project",
    "RobustObservation",
    "Scene",
    "Settings",
    "Tracker",
    "Visibility",
    "__version__",
    "export",
    "parameters",
    "to_dataframe",
    "to_supervision",
    "track",
]
