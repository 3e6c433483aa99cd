"""Patchlock, a visual object tracker.

Draw a box around anything in a video; Patchlock finds it in the other frames and reports how certain each box
is and which parts of the target are hidden.

`track` tracks through a video, a folder of images or any sequence of frames. `Tracker` takes frames one by
one. `MultiTracker` follows many targets. `Config` has their settings, `Network` a tracking network of yours.
`VideoWriter` draws tracks, `export` writes them in the formats of other tools, `read_track` reads saved ones.
`Project` reads and writes the annotations of `patchlock studio`.

A frame (`FrameLike`) is a numpy array of shape (height, width), grey, or (height, width, 3), colour, of
uint8, uint16 or float32; or a PIL image. float32 samples have black at 0 and white at 1.
Colour is red, green, blue unless `channels="bgr"` says otherwise.

A box (`BoxLike`) is four numbers: left, top, width and height in pixels, counted from 0; fractions are
allowed.

`preset="paper"` names a preset, and settings are keyword arguments: `Tracker(frame, box, search=7)`. A `Config`
holds both, and `parameters` lists them.

A value that is not allowed raises `ValueError`, a value of the wrong type and an unknown keyword `TypeError`, an
unknown setting of a `Config` `AttributeError`, and a file that can't be read `OSError`. The message says what is
allowed. A tracker is unchanged by a call that fails. """

from patchlock import rerun
from patchlock._export import export, export_formats
from patchlock._patchlock import (
    PRESETS,
    CommitteeObservation,
    Config,
    Estimate,
    Frames,
    ModelFile,
    MultiTracker,
    Network,
    NetworkConfig,
    NetworkObservation,
    PaperConfig,
    PaperObservation,
    PatchModelConfig,
    Project,
    RobustConfig,
    RobustObservation,
    Scene,
    Tracker,
    VideoWriter,
    __version__,
)
from patchlock._read import read_track, read_tracks
from patchlock._select import select_box
from patchlock._supervision import to_supervision
from patchlock._track import to_dataframe, track
from patchlock._types import Box, BoxLike, FrameLike, ModelLike, Parameter, Visibility, parameters

# Without the module `rerun`: a star import must not replace the package of that name.
__all__ = [
    "PRESETS",
    "Box",
    "BoxLike",
    "CommitteeObservation",
    "Config",
    "Estimate",
    "FrameLike",
    "Frames",
    "ModelFile",
    "ModelLike",
    "MultiTracker",
    "Network",
    "NetworkConfig",
    "NetworkObservation",
    "PaperConfig",
    "PaperObservation",
    "Parameter",
    "PatchModelConfig",
    "Project",
    "RobustConfig",
    "RobustObservation",
    "Scene",
    "Tracker",
    "VideoWriter",
    "Visibility",
    "__version__",
    "export",
    "export_formats",
    "parameters",
    "read_track",
    "read_tracks",
    "select_box",
    "to_dataframe",
    "to_supervision",
    "track",
]
