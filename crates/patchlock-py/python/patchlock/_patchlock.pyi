"""The Rust part of the package `patchlock`."""

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Self, Unpack

from patchlock._settings import Settings
from patchlock._types import Box, BoxLike, FrameLike, Visibility

__version__: Final[str]
__all__ = [
    "Estimate",
    "Frames",
    "MultiTracker",
    "Observation",
    "PRESETS",
    "Project",
    "RobustObservation",
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

    Frames are grey or colour arrays of uint8, uint16 or float32 with the shape (height, width) or
    (height, width, 3), or PIL images. Crops, frames with padding between rows and frames with reversed
    channels are read in place; arrays with other strides are copied. An array must not be modified while a
    call is using it.

    Each call releases the GIL, so trackers can run in parallel on several Python threads. One tracker
    processes one call at a time; a second thread waits. A tracker can be pickled or copied between two
    frames; the copy gives the same boxes.

    Args:
        preset: The preset to start from; `PRESETS` lists the names.
        config: A TOML file with settings that differ from the preset, as `patchlock config` writes it.
        threads: Number of threads for this tracker, 1 to 1024. `None` means one per core, in a pool that all
            such trackers of the process share. The number does not change the boxes.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV. PIL images carry their
            own order.
        **overrides: Settings that differ from the preset and the file, such as `seed=3`. `parameters()` lists
            all settings; `lambda` is written `lambda_`.

    Raises:
        TypeError: There is no such setting, or its value has the wrong type.
        ValueError: A setting is out of range, or the file is invalid.
        OSError: The file can't be read.
    """

    def __new__(
        cls,
        preset: str = "robust",
        *,
        config: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        **overrides: Unpack[Settings],
    ) -> Self: ...
    def init(self, frame: FrameLike, box: BoxLike) -> Estimate:
        """Starts tracking the target in this box of this frame.

        If the tracker already has a target, it is forgotten.

        Args:
            frame: The first frame.
            box: Left, top, width, height in pixels, counted from 0; may be fractional and partly outside the
                frame. Width and height must be at least 1.

        Raises:
            TypeError: The frame is neither an array of a supported type nor an image, or the box does not
                hold numbers.
            ValueError: The shape of the frame or the box is invalid. The tracker is unchanged.
        """

    def update(self, frame: FrameLike) -> Estimate:
        """Finds the target in the next frame and learns from it.

        Raises:
            RuntimeError: `init` has not been called.
            TypeError: The frame is neither an array of a supported type nor an image.
            ValueError: The frame has an invalid shape, or its size differs from the first frame's. The
                tracker is unchanged.
        """

    def update_observed(self, frame: FrameLike) -> tuple[Estimate, Observation | RobustObservation]:
        """Does the same as `update` and also returns what happened inside the tracker.

        The estimate is the same, but it takes longer: the method `patchwise` evaluates every particle
        completely, and the method `robust` computes its responses to the estimate again.

        Returns:
            The estimate and an `Observation`, or with the method `robust` a `RobustObservation`.

        Raises:
            RuntimeError: `init` has not been called.
            TypeError: The frame is neither an array of a supported type nor an image.
            ValueError: The frame has an invalid shape, or its size differs from the first frame's. The
                tracker is unchanged.
        """

    @property
    def config(self) -> dict[str, int | float | str | bool]:
        """All settings, by name."""

    @property
    def threads(self) -> int | None:
        """Number of threads; `None` means one per core, shared by all such trackers."""

    @property
    def channels(self) -> Literal["rgb", "bgr"]:
        """Channel order of colour arrays: "rgb" or "bgr"."""

    def snapshot(self) -> bytes:
        """The complete state of the tracker, as JSON text.

        A tracker restored from it gives the same boxes. The Rust library reads it as a `Snapshot`.
        """

    @classmethod
    def restore(
        cls,
        snapshot: bytes,
        *,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        frame: int = 0,
    ) -> Self:
        """Restores a tracker from a snapshot.

        Args:
            snapshot: What `snapshot` returned.
            threads: As for the constructor.
            channels: As for the constructor.
            frame: Number of frames since `init` when the snapshot was taken.

        Raises:
            ValueError: This is not a snapshot, or its parts are inconsistent.
        """

    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class MultiTracker:
    """Follows many targets through the frames of a video.

    Each target gets the boxes that a `Tracker` of its own would give. Targets can be added and removed at any
    frame. Each frame is converted once for all targets, and all threads work on all targets. To add targets
    on a frame where others are already tracked, call `update` first and then `add`.

    Frames, threads, pickling and copying work as for `Tracker`. All targets share the same settings.

    Args:
        preset: The preset to start from; `PRESETS` lists the names.
        config: A TOML file with settings that differ from the preset, as `patchlock config` writes it.
        threads: Number of threads for this tracker, 1 to 1024. `None` means one per core, in a pool that all
            such trackers of the process share. The number does not change the boxes.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV. PIL images carry their
            own order.
        **overrides: Settings that differ from the preset; `parameters()` lists all of them.

    Raises:
        TypeError: There is no such setting, or its value has the wrong type.
        ValueError: A setting is out of range, or the file is invalid.
        OSError: The file can't be read.
    """

    def __new__(
        cls,
        preset: str = "robust",
        *,
        config: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        **overrides: Unpack[Settings],
    ) -> Self: ...
    def add(self, frame: FrameLike, box: BoxLike) -> tuple[int, Estimate]:
        """Adds the target in this box of this frame; returns its id and first estimate.

        Ids count from 1 and are never reused.

        Raises:
            TypeError: The frame is neither an array of a supported type nor an image, or the box does not
                hold numbers.
            ValueError: The box is invalid, or the frame's size differs from earlier frames'. The tracker is
                unchanged.
        """

    def reinit(self, id: int, frame: FrameLike, box: BoxLike) -> Estimate:
        """Restarts an existing target on a box of this frame.

        Use it to correct a track by hand, or after the target was lost.

        Raises:
            KeyError: There is no target with this id.
            TypeError: As for `add`.
            ValueError: As for `add`.
        """

    def remove(self, id: int) -> None:
        """Removes a target.

        Raises:
            KeyError: There is no target with this id.
        """

    def update(self, frame: FrameLike) -> dict[int, Estimate]:
        """Finds all targets in the next frame and learns from it; returns an estimate for each id.

        `Estimate.ms` is the time for all targets together.

        Raises:
            TypeError: The frame is neither an array of a supported type nor an image.
            ValueError: The frame has an invalid shape, or its size differs from earlier frames'. All targets
                are unchanged.
        """

    @property
    def ids(self) -> list[int]:
        """The ids of the targets, in the order in which they were added."""

    def __len__(self) -> int: ...
    @property
    def config(self) -> dict[str, int | float | str | bool]:
        """All settings, by name."""

    @property
    def threads(self) -> int | None:
        """Number of threads; `None` means one per core, shared by all such trackers."""

    @property
    def channels(self) -> Literal["rgb", "bgr"]:
        """Channel order of colour arrays: "rgb" or "bgr"."""

    def snapshot(self) -> bytes:
        """The complete state of the tracker, as JSON text.

        A tracker restored from it gives the same boxes. The Rust library reads it as a `MultiSnapshot`.
        """

    @classmethod
    def restore(
        cls,
        snapshot: bytes,
        *,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        frame: int = 0,
    ) -> Self:
        """Restores a tracker from a snapshot.

        Args:
            snapshot: What `snapshot` returned.
            threads: As for the constructor.
            channels: As for the constructor.
            frame: Number of calls of `update` before the snapshot was taken.

        Raises:
            ValueError: This is not a snapshot, or its parts are inconsistent.
        """

    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class Estimate:
    """Where the target is in one frame, how certain that is, and how much of it is visible.

    Two estimates are equal if all fields except `ms` are equal. Pickling keeps every field.

    Args:
        box: Left, top, width, height in pixels, counted from 0.
        corners: Corners of the rotated outline, shape (4, 2).
        score: How certain the tracker is, 0 to 1.
        status: `"tracked"`, `"uncertain"` or `"lost"`.
        visibility: Maps of the visible patches, large and small; `None` if the method does not know.
        frame: Number of the frame.
        ms: Milliseconds that the tracker took for the frame.

    Raises:
        TypeError: An argument has the wrong type.
        ValueError: The status is unknown, or the number of corners is not 4.
    """

    def __new__(
        cls,
        box: BoxLike,
        corners: Sequence[Sequence[float]] | npt.NDArray[np.float64],
        score: float,
        status: Literal["tracked", "uncertain", "lost"],
        visibility: tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]] | None = None,
        frame: int = 0,
        ms: float = 0.0,
    ) -> Self: ...
    @property
    def frame(self) -> int:
        """Number of the frame.

        With `track` it is the number in the source; with a tracker it counts from the frame given to `init`.
        """

    @property
    def ms(self) -> float:
        """Milliseconds that the tracker took for the frame."""

    @property
    def box(self) -> Box:
        """The upright box `(x, y, w, h)` in pixels, counted from 0; may be fractional."""

    @property
    def corners(self) -> npt.NDArray[np.float64]:
        """Corners of the rotated outline as x, y in pixels, shape (4, 2).

        The order is top left, top right, bottom right, bottom left of the unrotated target.
        """

    @property
    def score(self) -> float:
        """How certain the tracker is, 0 to 1.

        With the method `robust` it is an estimate of the probability that the box overlaps the target by at
        least half, with `patchwise` the visible share of the target: the mean over both scales.
        """

    @property
    def status(self) -> Literal["tracked", "uncertain", "lost"]:
        """Whether the target is followed: "tracked", "uncertain" or "lost".

        While it is lost, the box and the corners are the last ones that were known.
        """

    @property
    def visibility(self) -> Visibility | None:
        """Which patches are visible, large and small; `None` if the method does not know.

        Patches are in row order of the unrotated target: by default 3 x 3 and 7 x 7.
        """

    def to_dict(self) -> dict[str, float | str | None]:
        """One row of the table that `patchlock track` saves, by column name, without the time.

        The columns are frame, x, y, w, h, score, visible_large, visible_small, x1, y1 to x4, y4, ms and
        status. The visible shares are `None` if the method does not know them. The position of a lost target
        is the last one that was known, as with `--lost keep`.
        """

    def numbered(self, frame: int) -> Estimate:
        """A copy of the estimate with another frame number."""

    def draw(
        self, frame: FrameLike, *, channels: Literal["rgb", "bgr"] = "rgb"
    ) -> npt.NDArray[np.uint8]:
        """Draws the estimate on a copy of a frame.

        The lines are those of the command `patchlock track --video`: the upright box is white, the outline
        goes from orange to teal with the score, both are dashed while the target is uncertain. Of a lost target
        the last known box is drawn in grey.

        Args:
            frame: The frame, as for `Tracker`. uint16 samples are divided by 256, float32 samples are from 0
                to 1.
            channels: Channel order of colour arrays, also of the result.

        Returns:
            The picture, uint8, shape (height, width, 3).

        Raises:
            TypeError: The frame is neither an array of a supported type nor an image.
            ValueError: The frame has an invalid shape.
        """

    def __eq__(self, other: object, /) -> bool: ...

@final
class Observation:
    """What the method `patchwise` computed on one frame; `Tracker.update_observed` returns it."""

    @property
    def particles(self) -> npt.NDArray[np.float64]:
        """The particles, shape (particles, 6).

        The columns are x and y of the centre in pixels, scale, rotation, aspect and skew.
        """

    @property
    def likelihoods(self) -> npt.NDArray[np.float64]:
        """The likelihood of each particle (Eq. 24); larger is better, with no fixed scale."""

    @property
    def best(self) -> int:
        """Index of the particle that became the estimate."""

    @property
    def candidate(self) -> npt.NDArray[np.float32]:
        """The estimate's candidate, shape (side, side): warped to the template size, with unit norm."""

    @property
    def templates(self) -> npt.NDArray[np.float32]:
        """All templates after this frame, shape (templates, side, side), newest last."""

    @property
    def replaced(self) -> int | None:
        """Former index of the template that this frame replaced; `None` if none was replaced."""

    @property
    def mask(self) -> npt.NDArray[np.float64] | None:
        """Occlusion mask of the new template, shape (side, side); `None` if no template was replaced.

        1 is visible, 0 is hidden.
        """

@final
class RobustObservation:
    """What the method `robust` computed on one frame; `Tracker.update_observed` returns it."""

    @property
    def frame(self) -> int:
        """Frames since `init`."""

    @property
    def certainty(self) -> float:
        """How certain the memory is of the estimate: its response there over its mean on sure frames."""

    @property
    def elsewhere(self) -> float:
        """The memory's strongest response more than half the target's width or height away from the estimate.

        It is relative to the response at the estimate, from 0 to 2.
        """

    @property
    def contrast(self) -> float:
        """How well colour tells the target from what is around it: from -1 through 0, not at all, to 1."""

    @property
    def side(self) -> int:
        """Number of cells on a side of the search window around the estimate."""

    @property
    def cell(self) -> float:
        """Side of a cell, in pixels of the frame."""

    @property
    def follower(self) -> npt.NDArray[np.float32]:
        """The response of the follower, the mean of its filters, shape (side, side).

        The entry [0, 0] is the centre of the estimate; entries further on are displacements down and to the
        right, those beyond half the side up and to the left. `numpy.fft.fftshift` puts the centre into the
        middle.
        """

    @property
    def memory(self) -> npt.NDArray[np.float32]:
        """The memory's response, shape (side, side), in the same order."""

@final
class Frames:
    """Iterates over the frames of a source with their numbers, decoding ahead on a thread.

    It yields pairs of a frame number and an array of shape (height, width) or (height, width, 3) in RGB
    order, uint8 or uint16 as in the source.

    Args:
        source: Any source that the command accepts: a folder of images, a pattern such as
            `"img/%04d.jpg"`, a glob, an MP4 (H.264) or Y4M file, any other video if `ffmpeg` is installed, or
            `"-"` for Y4M on standard input.
        start: Number of the first frame of the range.
        end: Number of the first frame after the range; `None` for the end of the source.
        stride: Take every `stride`-th frame.
        reverse: Go from the last frame of the range to the first.
        max_pixels: Most pixels of a frame, width times height. A source that claims more is refused before
            memory is taken for it.

    Raises:
        ValueError: The range contains no frame.
        OSError: The source can't be read; `FileNotFoundError` if it does not exist.
    """

    def __new__(
        cls,
        source: str | os.PathLike[str],
        *,
        start: int = 0,
        end: int | None = None,
        stride: int = 1,
        reverse: bool = False,
        max_pixels: int = 36_000_000,
    ) -> Self: ...
    @property
    def count(self) -> int | None:
        """Number of frames in the range; `None` if it is not known in advance."""

    @property
    def rate(self) -> float | None:
        """Frames per second of the source; `None` if the source does not say."""

    def __iter__(self) -> Self: ...
    def __next__(self) -> tuple[int, npt.NDArray[np.uint8] | npt.NDArray[np.uint16]]: ...

@final
class Scene:
    """A short rendered video whose true boxes are known.

    It needs no file: `scene[k]` is frame k as an RGB array, and `track` accepts the scene as a source.

    Args:
        name: `"demo"` (210 frames with rotation, a tree that hides all of the target, and changes of light),
            `"simple"` (40 frames of slow motion) or `"occluded"` (60 frames with occlusion by a tree).

    Raises:
        ValueError: There is no scene with this name.
    """

    def __new__(cls, name: Literal["demo", "simple", "occluded"] = "demo") -> Self: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> npt.NDArray[np.uint8]: ...
    def truth(self, index: int) -> Box:
        """The target's true box in a frame."""

    def hidden(self, index: int) -> float:
        """Share of the target that is hidden in a frame, 0 to 1."""

@final
class Project:
    """The annotations of a video, in a file as `patchlock studio` writes it.

    Changes are in memory until `save`. The file is not locked before that, so it can be read while
    `patchlock studio` has it open. Frames count from 0.

    Args:
        path: The project file, such as `clip.patchlock.json`.
        video: The video file or folder of images. Needed to begin a project; without it the file must exist.
        max_pixels: Most pixels of a frame, width times height. A video that claims more is refused before
            memory is taken for it.

    Raises:
        ValueError: The file is not a project, or belongs to another video.
        OSError: The file or the video can't be read.
    """

    def __new__(
        cls,
        path: str | os.PathLike[str],
        video: str | os.PathLike[str] | None = None,
        *,
        max_pixels: int = 36_000_000,
    ) -> Self: ...
    @property
    def path(self) -> Path:
        """The project file."""

    @property
    def video(self) -> Path:
        """The video file or folder of images."""

    @property
    def frames(self) -> int:
        """Number of frames of the video."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frames in pixels."""

    @property
    def changed(self) -> str | None:
        """How the video has changed since the project was begun, in words; `None` if it has not."""

    @property
    def done(self) -> bool:
        """Whether a person said that the video is annotated completely. It can be set."""

    @done.setter
    def done(self, done: bool) -> None: ...
    @property
    def labels(self) -> list[tuple[str, str]]:
        """Names and colours (`#rrggbb`) of the labels, in the order in which they are offered."""

    @property
    def targets(self) -> list[int]:
        """The ids of the targets, in the order in which they were made."""

    def label(self, target: int) -> str:
        """The label of a target."""

    def attributes(self, target: int) -> dict[str, str]:
        """The attributes of a target."""

    def keys(self, target: int) -> dict[int, dict[str, Any]]:
        """The boxes that a person has drawn, by frame.

        Each is a dictionary with `box`, `occluded` and `truncated`.
        """

    def tracked(self, target: int) -> dict[int, dict[str, Any]]:
        """The boxes that were tracked, by frame.

        Each is a dictionary with `box`, `score` (0 to 1), `status` (`"tracked"`, `"uncertain"` or `"lost"`),
        and, or `None`, `visible` (the visible share) and `agreement` (the overlap of the boxes tracked
        forward and backward).
        """

    def boxes(self, target: int) -> dict[int, Box]:
        """All boxes of a target by frame, drawn or tracked, without those where it is lost."""

    def hidden(self, target: int) -> list[tuple[int, int]]:
        """First and last frame of each stretch in which a target is not visible."""

    def add_target(self, label: str, frame: int, box: BoxLike) -> int:
        """Adds a target with one key frame. A label that does not exist is added.

        Returns:
            The id of the target.

        Raises:
            ValueError: The frame is not in the video, or the box is not possible.
        """

    def set_key(
        self, target: int, frame: int, box: BoxLike, *, occluded: bool = False, truncated: bool = False
    ) -> None:
        """Draws the box of a target in a frame, which becomes a key frame.

        Raises:
            ValueError: There is no such target, or the frame or box is not possible.
        """

    def set_tracked(self, target: int, estimates: Iterable[Estimate]) -> None:
        """Adds what a tracker found, by `Estimate.frame`, in place of the tracked boxes so far.

        All from the first to the last of these frames are replaced. Frames with a key and hidden frames stay
        as they are.

        Raises:
            ValueError: There is no such target, a frame is not in the video, or there are no estimates.
        """

    def hide(self, target: int, first: int, last: int) -> None:
        """Says that a target is not visible in the frames `first` to `last`; its boxes there are removed.

        Raises:
            ValueError: There is no such target, or the frames are not in the video.
        """

    def delete_target(self, target: int) -> None:
        """Deletes a target.

        Raises:
            ValueError: There is no such target.
        """

    def edit(self, edits: Sequence[Mapping[str, Any]]) -> None:
        """Applies any edits, all or none, as one step that `undo` takes back.

        Args:
            edits: Dictionaries such as `{"edit": "split", "target": 1, "frame": 30}`; the guide lists them.

        Raises:
            ValueError: An edit is unknown or not possible; nothing is changed.
        """

    def undo(self) -> bool:
        """Takes back the last change; `False` if there is none."""

    def redo(self) -> bool:
        """Makes the change again that was taken back last; `False` if there is none."""

    def import_file(
        self, file: str | os.PathLike[str], format: Literal["csv", "mot", "cvat", "coco"]
    ) -> list[int]:
        """Adds the targets of a file of another tool, or of a table.

        Args:
            file: The file to read.
            format: `"csv"` (also JSON lines), `"mot"`, `"cvat"` or `"coco"`.

        Returns:
            The ids of the new targets.

        Raises:
            ValueError: The file has another format, or boxes that are not possible.
            OSError: The file can't be read.
        """

    def export(
        self,
        format: Literal["csv", "mot", "coco", "cvat", "yolo", "voc", "label-studio", "lasot", "got10k"],
        out: str | os.PathLike[str],
        *,
        frames: bool = False,
        name: str | None = None,
        key_frames: int = 1,
        overwrite: bool = False,
    ) -> int:
        """Writes the project in the format of another tool, or as a table.

        Files are written completely or not at all.

        Args:
            format: A format of `patchlock.export`, or `"csv"`.
            out: The file or folder to create. A folder must be empty or not exist yet.
            frames: Copy the frames into formats that include them.
            name: Name of the video; `None` for that of its file.
            key_frames: As in `patchlock.export`.
            overwrite: Replace an existing file. A folder that is not empty is never replaced.

        Returns:
            The number of files written.

        Raises:
            ValueError: There are no boxes, there is no such format, or `out` exists.
            OSError: A file can't be read or written.
        """

    def save(self) -> None:
        """Writes the file, whole or not at all.

        Raises:
            OSError: It can't be written, another program has the project open, or has changed the file since
                it was read.
        """

@final
class Store:
    """The results folder of one tracker, with runs in the format of `patchlock bench`."""

    def __new__(
        cls,
        out: str | os.PathLike[str],
        name: str,
        *,
        chosen: bool,
        preset: str,
        config: str | os.PathLike[str] | None,
        base: dict[str, Any],
        own: dict[str, Any],
    ) -> Self: ...
    @property
    def folder(self) -> Path:
        """Path of the folder."""

    @property
    def first_seed(self) -> int:
        """The seed for clips that specify none."""

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
        """Describes the run on a clip as a JSON message.

        `source` is recorded in the manifest; `path` locates the clip from any working directory.
        """

    def holds(self, job: str) -> bool:
        """Whether the complete run is already stored."""

    def keep(self, job: str, boxes: str, manifest: str) -> None:
        """Stores the two files of a run."""

def track_job(job: str) -> tuple[str, str]:
    """Performs a run; returns its boxes as text and its manifest."""

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
    """Plans a benchmark.

    Returns the store, the jobs to run, the number of runs that are already stored, and the failures: targets
    that can't be run.
    """

def read_truth(path: str | os.PathLike[str]) -> list[tuple[float, float, float, float] | None]:
    """Reads the boxes of a truth file; `None` for a frame without a box.

    The file counts pixels from 1; the boxes returned count from 0.
    """

def parameters() -> list[tuple[str, int | float | str | bool, str, str, str]]:
    """The rows of the table of settings: name, default, allowed values, source, purpose."""

def run(args: list[str]) -> int:
    """Runs the command with these arguments, program name first; returns the exit code."""

def _export(
    track: str
    | os.PathLike[str]
    | list[tuple[int, int, tuple[float, float, float, float], float, list[list[float]], str]],
    format: str,
    out: str | os.PathLike[str],
    size: tuple[int, int] | None,
    images: str | os.PathLike[str] | None,
    label: str,
    name: str,
    key_frames: int,
    overwrite: bool,
) -> int:
    """Writes a track in another format; returns the number of files written."""

def _restore_many(snapshot: bytes, threads: int | None, channels: str, frame: int) -> MultiTracker:
    """Called by pickle."""

def _restore(snapshot: bytes, threads: int | None, channels: str, frame: int) -> Tracker:
    """Called by pickle."""
