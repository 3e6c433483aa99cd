"""The Rust part of the package `patchlock`."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, Literal, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Self, Unpack

from patchlock._settings import Settings
from patchlock._types import Box, BoxLike, FrameLike, Occlusion, Visibility

__version__: Final[str]
__all__ = [
    "Estimate",
    "Frames",
    "MultiTracker",
    "Observation",
    "PRESETS",
    "Scene",
    "Store",
    "Tracker",
    "__version__",
    "_export",
    "_restore",
    "_restore_many",
    "bench_jobs",
    "parameters",
    "read_truth",
    "run",
    "track_job",
]

PRESETS: Final[list[str]]

@final
class Tracker:
    """Follows one target through the frames of a video.

    Frames are grey or colour arrays of uint8, uint16 or float32 with the shape (height, width) or (height, width, 3), or PIL images. They
    are read where they are: crops, frames with gaps between rows and reversed colours are not copied, other strides are. Nobody may write to
    an array while a call works on it.

    The interpreter's lock is released during each call, so trackers run side by side on threads. One tracker does one thing at a time: a
    second thread waits. A tracker can be pickled and copied between two frames, and goes on to the same boxes.

    Args:
        preset: The settings to begin with; `PRESETS` has the names.
        threads: Threads for this tracker, 1 to 1024; `None` for one for each core, shared by all such trackers of the process. The boxes
            are the same for any number.
        channels: The order of colours in arrays: `"bgr"` for what OpenCV reads. A PIL image knows its own.
        **overrides: Settings that differ from the preset, such as `seed=3`; `parameters()` lists all (`lambda` is written `lambda_`).

    Raises:
        TypeError: There is no such setting, or it is of another kind.
        ValueError: A setting is outside its range.
    """

    def __new__(
        cls,
        preset: str = "paper",
        *,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        **overrides: Unpack[Settings],
    ) -> Self: ...
    def init(self, frame: FrameLike, box: BoxLike) -> Estimate:
        """Begins on the target in this box of this frame; a target so far is forgotten.

        Args:
            frame: The frame.
            box: Left, top, width, height in pixels, counted from 0, with fractions. It may be partly outside; sides are at least 1.

        Raises:
            TypeError: The frame is neither an array of such a type nor an image, or the box holds no numbers.
            ValueError: The shape of the frame, or the box, is not as it must be. The tracker is as it was.
        """

    def update(self, frame: FrameLike) -> Estimate:
        """Finds the target in the next frame and learns from it.

        Raises:
            RuntimeError: There was no `init` yet.
            TypeError: The frame is neither an array of such a type nor an image.
            ValueError: The frame has another size than the first one, or a wrong shape. The tracker is as it was.
        """

    def update_observed(self, frame: FrameLike) -> tuple[Estimate, Observation]:
        """As `update`, and gives what happened inside: the boxes are the same, but all particles are weighed to the end, which takes longer.

        Raises:
            RuntimeError: There was no `init` yet.
            TypeError: The frame is neither an array of such a type nor an image.
            ValueError: The frame has another size than the first one, or a wrong shape. The tracker is as it was.
        """

    @property
    def config(self) -> dict[str, int | float | str | bool]:
        """All settings by name."""

    @property
    def threads(self) -> int | None:
        """The number of threads; `None` for one for each core, shared by all such trackers."""

    @property
    def channels(self) -> Literal["rgb", "bgr"]:
        """The order of colours in arrays: "rgb" or "bgr"."""

    def snapshot(self) -> bytes:
        """Everything that is needed to go on to the same boxes later, also from Rust: a `Snapshot` as JSON text."""

    @classmethod
    def restore(
        cls,
        snapshot: bytes,
        *,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        frame: int = 0,
    ) -> Self:
        """A tracker that goes on where the snapshot was taken, `frame` frames after `init`.

        Raises:
            ValueError: This is no snapshot, or its parts do not fit together.
        """

    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class MultiTracker:
    """Follows many targets through the frames of a video.

    Each gets the boxes that a `Tracker` of its own would give.

    Targets come and go at any frame. A frame is converted once for all of them, and all threads work on all targets. On a frame where targets go on and
    others begin, call `update` first and `add` after it. Frames, threads, pickling and copying are as with `Tracker`; all targets have the same settings.

    Args:
        preset: The settings to begin with; `PRESETS` has the names.
        threads: Threads for this tracker, 1 to 1024; `None` for one for each core, shared by all such trackers of the process. The boxes
            are the same for any number.
        channels: The order of colours in arrays: `"bgr"` for what OpenCV reads. A PIL image knows its own.
        **overrides: Settings that differ from the preset; `parameters()` lists all.

    Raises:
        TypeError: There is no such setting, or it is of another kind.
        ValueError: A setting is outside its range.
    """

    def __new__(
        cls,
        preset: str = "paper",
        *,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        **overrides: Unpack[Settings],
    ) -> Self: ...
    def add(self, frame: FrameLike, box: BoxLike) -> tuple[int, Estimate]:
        """Begins on the target in this box of this frame; gives its id and the first estimate.

        Ids count from 1, and none is given twice.

        Raises:
            TypeError: The frame is neither an array of such a type nor an image, or the box holds no numbers.
            ValueError: The frame has another size than those so far, or the box is not as it must be. Nothing has changed.
        """

    def reinit(self, id: int, frame: FrameLike, box: BoxLike) -> Estimate:
        """Begins anew with a target that there is, on a box of this frame.

        That corrects its track by hand, or after a loss.

        Raises:
            KeyError: There is no target with this id.
            TypeError: As with `add`.
            ValueError: As with `add`.
        """

    def remove(self, id: int) -> None:
        """Forgets a target.

        Raises:
            KeyError: There is no target with this id.
        """

    def update(self, frame: FrameLike) -> dict[int, Estimate]:
        """Finds all targets in the next frame and learns from it: an estimate for each id.

        `Estimate.ms` is the time that all of them took.

        Raises:
            TypeError: The frame is neither an array of such a type nor an image.
            ValueError: The frame has another size than those so far, or a wrong shape. All targets are as they were.
        """

    @property
    def ids(self) -> list[int]:
        """The ids of the targets, in the order in which they were added."""

    def __len__(self) -> int: ...
    @property
    def config(self) -> dict[str, int | float | str | bool]:
        """All settings by name."""

    @property
    def threads(self) -> int | None:
        """The number of threads; `None` for one for each core, shared by all such trackers."""

    @property
    def channels(self) -> Literal["rgb", "bgr"]:
        """The order of colours in arrays: "rgb" or "bgr"."""

    def snapshot(self) -> bytes:
        """Everything that is needed to go on to the same boxes later, also from Rust: a `MultiSnapshot` as JSON text."""

    @classmethod
    def restore(
        cls,
        snapshot: bytes,
        *,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        frame: int = 0,
    ) -> Self:
        """A tracker that goes on where the snapshot was taken, after so many frames.

        Raises:
            ValueError: This is no snapshot, or its parts do not fit together.
        """

    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class Estimate:
    """Where the target is in one frame, how much of it is seen, and how sure that is."""

    def __new__(
        cls,
        box: BoxLike,
        corners: Sequence[Sequence[float]] | npt.NDArray[np.float64],
        likelihood: float,
        occlusion: tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]],
        frame: int = 0,
        ms: float = 0.0,
    ) -> Self: ...
    @property
    def frame(self) -> int:
        """Number of the frame: in the source for `track`, else counted from the one given to `init`."""

    @property
    def ms(self) -> float:
        """Milliseconds that the tracker took for the frame."""

    @property
    def box(self) -> Box:
        """The upright box `(x, y, w, h)` in pixels, counted from 0, with fractions."""

    @property
    def corners(self) -> npt.NDArray[np.float64]:
        """The corners of the turned outline, shape (4, 2) as x, y: top left, top right, bottom right, bottom left."""

    @property
    def score(self) -> float:
        """How much of the target is seen, 0 to 1: the mean of the visible shares at both scales."""

    @property
    def likelihood(self) -> float:
        """The likelihood of the paper's Eq. 24; larger is better, with no fixed scale."""

    @property
    def visibility(self) -> Visibility:
        """Shares of visible patches, `(large, small)`, each 0 to 1."""

    @property
    def occlusion(self) -> Occlusion:
        """Which patches are hidden, `(large, small)`: boolean arrays of patches, row by row as the target is turned.

        They have 3 x 3 and 13 x 13 patches with the preset `paper`.
        """

    def to_dict(self) -> dict[str, float]:
        """The columns of a table as `patchlock track` saves it: frame, x, y, w, h, score, visible_large, visible_small, x1 to y4, ms."""

    def numbered(self, frame: int) -> Estimate:
        """The same estimate of the frame with this number."""

    def __eq__(self, other: object, /) -> bool: ...

@final
class Observation:
    """What `Tracker.update_observed` gives beside the estimate."""

    @property
    def particles(self) -> npt.NDArray[np.float64]:
        """The particles, shape (particles, 6): x and y of the centre in pixels, scale, rotation, aspect, skew."""

    @property
    def likelihoods(self) -> npt.NDArray[np.float64]:
        """The likelihood of each particle; minus infinity where a candidate was refused."""

    @property
    def best(self) -> int:
        """The index of the estimate among the particles."""

    @property
    def candidate(self) -> npt.NDArray[np.float32]:
        """The estimate's candidate, shape (side, side): warped to the template's size, of unit norm."""

    @property
    def templates(self) -> npt.NDArray[np.float32]:
        """All templates after this frame, shape (templates, side, side), the newest last."""

    @property
    def replaced(self) -> int | None:
        """The index that the template had which this frame replaced; `None` where none was."""

    @property
    def mask(self) -> npt.NDArray[np.float64] | None:
        """The occlusion mask that the new template was made with, shape (side, side), 1 where visible; `None` where there was none."""

@final
class Frames:
    """The frames of a source with their numbers, decoded ahead on a thread.

    It yields pairs of number and array, of shape (height, width) or (height, width, 3) in RGB, in the depth of the source.

    Args:
        source: What the command takes: a folder of images, a pattern such as `"img/%04d.jpg"`, a glob, an MP4 (H.264) or Y4M file, any
            other video if there is a program `ffmpeg`, or `"-"` for Y4M on standard input.
        start: Number of the first frame of the range.
        end: Number of the first frame after the range; `None` for all frames.
        stride: Take every so many frames.
        reverse: From the last frame of the range to the first.

    Raises:
        ValueError: The range holds no frame.
        OSError: The source can't be read; `FileNotFoundError` where nothing is.
    """

    def __new__(
        cls,
        source: str | os.PathLike[str],
        *,
        start: int = 0,
        end: int | None = None,
        stride: int = 1,
        reverse: bool = False,
    ) -> Self: ...
    @property
    def count(self) -> int | None:
        """How many frames will come, where that is known before the end."""

    @property
    def rate(self) -> float | None:
        """Frames a second, where the source says so."""

    def __iter__(self) -> Self: ...
    def __next__(self) -> tuple[int, npt.NDArray[np.uint8] | npt.NDArray[np.uint16]]: ...

@final
class Scene:
    """A short rendered film with a known truth.

    It needs no file and belongs to nobody else: `scene[k]` is frame k, an RGB array, and `track` takes the scene as it is.

    Args:
        name: `"demo"` (150 frames with turns, a tree in the way and changes of light), `"simple"` (40 frames of an easy move) or
            `"occluded"` (60 frames with a tree in the way).
    """

    def __new__(cls, name: Literal["demo", "simple", "occluded"] = "demo") -> Self: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> npt.NDArray[np.uint8]: ...
    def truth(self, index: int) -> Box:
        """The target's true box in a frame: what the tracker should find."""

    def hidden(self, index: int) -> float:
        """The share of the target that is truly hidden in a frame, 0 to 1."""

@final
class Store:
    """The folder of one tracker, with runs as `patchlock bench` writes them."""

    def __new__(
        cls,
        out: str | os.PathLike[str],
        name: str,
        *,
        preset: str,
        config: str | os.PathLike[str] | None,
        base: dict[str, Any],
        own: dict[str, Any],
    ) -> Self: ...
    @property
    def folder(self) -> Path:
        """The folder."""

    @property
    def first_seed(self) -> int:
        """The seed of clips that have none of their own."""

    def clip(
        self,
        target: str,
        seed: int,
        bbox: Sequence[float],
        *,
        source: str,
        path: str,
        start: int,
        end: int | None,
        stride: int,
        threads: int,
        side_by_side: int,
    ) -> str:
        """The run on a clip. `source` is what its manifest says, `path` where it is found from any working directory."""

    def holds(self, job: str) -> bool:
        """Whether the run is there, complete."""

    def keep(self, job: str, boxes: str, manifest: str) -> None:
        """Puts the two files of a run in their place."""

def track_job(job: str) -> tuple[str, str]:
    """Makes a run; gives its text of boxes and its manifest."""

def bench_jobs(
    dataset: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    protocol: str,
    preset: str,
    config: str | os.PathLike[str] | None,
    command: str | None,
    timeout: int,
    name: str | None,
    seeds: int,
    sequences: list[str],
    attributes: list[str],
    threads: int,
    side_by_side: int,
) -> tuple[Store, list[tuple[str, str, str]], int, list[tuple[str, str, str]]]:
    """What a benchmark with these options would run: the store, the jobs, how many are there already, and what can't be run."""

def read_truth(path: str | os.PathLike[str]) -> list[tuple[float, float, float, float] | None]:
    """The boxes of a truth file that counts from 1, counted from 0; `None` for a frame without one."""

def parameters() -> list[tuple[str, int | float | str | bool, str, str, str]]:
    """The rows of the table of settings."""

def run(args: list[str]) -> int:
    """Runs the command with these arguments, the program's name first; gives the exit code."""

def _export(
    track: str | os.PathLike[str] | list[tuple[int, int, tuple[float, float, float, float], float, list[list[float]]]],
    format: str,
    out: str | os.PathLike[str],
    size: tuple[int, int] | None,
    images: str | os.PathLike[str] | None,
    label: str,
    name: str,
    overwrite: bool,
) -> int:
    """Writes a track in a format; gives the number of files."""

def _restore_many(snapshot: bytes, threads: int | None, channels: str, frame: int) -> MultiTracker:
    """What a pickle calls."""

def _restore(snapshot: bytes, threads: int | None, channels: str, frame: int) -> Tracker:
    """What a pickle calls."""
