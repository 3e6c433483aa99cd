"""The Rust part of the package `patchlock`. Written by tools/python/stubs.py."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Self

from patchlock._types import Box, BoxLike, FrameLike, ModelLike, Visibility

__version__: Final[str]
__all__ = [
    "CommitteeObservation",
    "Config",
    "Estimate",
    "Frames",
    "ModelFile",
    "MultiTracker",
    "Network",
    "NetworkConfig",
    "NetworkObservation",
    "PRESETS",
    "PaperConfig",
    "PaperObservation",
    "PatchModelConfig",
    "Project",
    "RobustConfig",
    "RobustObservation",
    "Scene",
    "Store",
    "Tracker",
    "VideoWriter",
    "__version__",
    "_box",
    "_checked_config",
    "_export",
    "_export_formats",
    "_iou",
    "_read_estimates",
    "_restore",
    "_restore_config",
    "_restore_many",
    "_restore_network",
    "_select_boxes",
    "abandon_files",
    "bench_jobs",
    "parameters",
    "read_truth",
    "run",
    "track_job",
]

PRESETS: Final[list[str]]

@final
class Config:
    """The settings of a tracker.

    The preset chooses the method, `robust`, `paper` or `network`. The settings of the method are in the group of
    its name, those of the patch model of `robust` and `paper` in the group `patches` in it:

    ```python
    config = patchlock.Config()
    config.seed = 3
    config.robust.search = 7
    config.robust.patches.templates = 8
    ```

    `parameters()` describes every setting. A tracker copies its settings when it starts, so a later change has
    no effect on it. Settings can be compared, copied and pickled. A pickle holds the paths of the network's
    files, not the network; see `Network`.

    Args:
        preset: The preset to start from; `PRESETS` lists the names.
        file: A TOML file with settings that differ from the preset, as `patchlock config` writes it.
        settings: Settings to change, by name, such as `search=7`.
        model: The network: a `Network`, what `Network` takes, or `"none"`. By default that of the file, or
            else `"patchnet"` with `robust` and `network`.
        runtime: What runs the network, as for `Network`, if `model` is not a `Network`.

    Raises:
        AttributeError: An attribute is not a setting, or belongs to another method.
        TypeError: The value of a setting or of an argument has the wrong type, or a keyword argument is not a
            setting.
        ValueError: There is no such preset, the value of a setting is not allowed, the file is invalid, or the
            network can't be used.
        OSError: A file can't be read.
        ImportError: `runtime` is `"onnxruntime"`, which is not installed.
    """

    seed: int
    """Seed of all randomness: the same seed gives the same boxes. Allowed: 0 to 9007199254740991.
    """
    def __new__(
        cls,
        preset: str = "robust",
        file: str | os.PathLike[str] | None = None,
        *,
        model: Network | ModelLike | None = None,
        runtime: str | os.PathLike[str] | None = None,
        **settings: float | str | bool,
    ) -> Self: ...
    @property
    def model(self) -> Network | None:
        """The network; `None` if there is none."""

    robust: RobustConfig
    """The settings of the method `robust`; only with its presets."""
    paper: PaperConfig
    """The settings of the method `paper`; only with its preset."""
    network: NetworkConfig
    """The settings of the method `network`; only with its preset."""

    def to_dict(self) -> dict[str, Any]:
        """All settings: a dictionary of `seed` and of the method's group, whose settings are a dictionary, too.
        """

    def __eq__(self, other: object, /) -> bool: ...

@final
class RobustConfig:
    """The settings of the method `robust`: `Config.robust`."""

    search: float
    """Side of the search window, in roots of the target's area. Allowed: 1.5 to 20."""
    temporal: float
    """How strongly the filter is drawn to the one before; larger values learn more slowly. Allowed:
    0 to 1000000.
    """
    patch: float
    """Side of the patch that the search window is resampled to, in pixels. Allowed: 32 to 512."""
    least_side: float
    """Shortest side to which the target may shrink, in pixels. Allowed: 1 to 1000."""
    scale_count: int
    """Number of scales that are tried on each frame; an odd number. Allowed: 3 to 99."""
    scale_step: float
    """Ratio of neighbouring scales. Allowed: 1.001 to 1.2."""
    scale_rate: float
    """Learning rate of the scale filter. Allowed: 0 to 1."""
    rotate: bool
    """Whether rotation in the frame is followed. Allowed: true, false."""
    colour_weight: float
    """Weight of the map of the target's colours, relative to the memory's mean response. Allowed: 0
    to 10.
    """
    memory_rate: float
    """Learning rate of the memory, which averages the tracking filters over sure frames. Allowed: 0
    to 1.
    """
    lost_after: int
    """The target is lost after this many consecutive doubtful frames. Allowed: 1 to 10000."""
    found_above: float
    """While the target is lost, a place counts as found if the memory's response is above this
    share of its mean. Allowed: 0 to 10.
    """
    trial: int
    """A place that was found is accepted after this many frames that do not count as lost. Allowed:
    1 to 10000.
    """
    trial_shown: float
    """A place that was found is not accepted if the mean share of the target that was reported as
    visible on the last frames is below this. Allowed: 0 to 1.
    """
    search_windows: int
    """Number of windows that are searched on each frame while the target is lost. Allowed: 1 to
    1000.
    """
    search_larger: float
    """Size of the target in the second of four passes of the search over the frame, relative to the
    last one. Allowed: 0.1 to 10.
    """
    search_smaller: float
    """Size of the target in the third of four passes of the search over the frame, relative to the
    last one. Allowed: 0.1 to 10.
    """
    shown_epsilon: float
    """A patch is reported as visible, and counts for score and status, when the squared error of
    its own-location code is below this. What is learned, and whether the target is covered, is
    decided with the stricter `epsilon`. Allowed: 0 to 4.
    """
    score_tracked: float
    """The target counts as tracked from this score on. Allowed: 0 to 1."""
    visible_tracked: float
    """The target counts as tracked only if at least this share of it is visible and, with a
    network, filters and network agree; or, with a network, from a score of 0.9 on if their boxes
    touch. If less is visible then, `visibility` is not known. Allowed: 0 to 1.
    """
    score_lost: float
    """The target counts as lost below this score, also before it is given up. The score is at most
    this once it is given up. Allowed: 0 to 1.
    """
    network_fit: float
    """Share of the difference between the box of the first frame and what the network sees there,
    on a logarithmic scale, that is taken out of all its later boxes. Allowed: 0 to 1.
    """
    patches: PatchModelConfig
    """The settings of the patch model."""

    def __eq__(self, other: object, /) -> bool: ...

@final
class PaperConfig:
    """The settings of the method `paper`: `Config.paper`."""

    particles: int
    """Number of particles, which are weighed on each frame. Allowed: 1 to 100000."""
    sigma_x: float
    """Standard deviation of the centre's motion along x, in pixels per frame. Allowed: 0 to 1000.
    """
    sigma_y: float
    """Standard deviation of the centre's motion along y, in pixels per frame. Allowed: 0 to 1000.
    """
    sigma_scale: float
    """Standard deviation of the change of scale (box width / template side) per frame. Allowed: 0
    to 10.
    """
    sigma_rotation: float
    """Standard deviation of the change of rotation, in radians per frame. Allowed: 0 to 10."""
    sigma_aspect: float
    """Standard deviation of the change of the aspect ratio (height / width) per frame. Allowed: 0
    to 10.
    """
    sigma_skew: float
    """Standard deviation of the change of skew, in radians per frame. Allowed: 0 to 10."""
    beta: float
    """How fast the position weight falls with the distance from the centre, per patch. Allowed: 0
    to 100.
    """
    position_weights: bool
    """Whether patches have position weights at all. Allowed: true, false."""
    occlusion_weights: bool
    """Whether hidden patches lose their position weight. Allowed: true, false."""
    gamma: Literal["exp_visible", "one", "visible", "exp_error"]
    """Weight of the large scale in the likelihood. Allowed: exp_visible, one, visible, exp_error.
    """
    scales: Literal["both", "large", "small"]
    """Which scales the likelihood adds. Allowed: both, large, small."""
    patches: PatchModelConfig
    """The settings of the patch model."""

    def __eq__(self, other: object, /) -> bool: ...

@final
class NetworkConfig:
    """The settings of the method `network`: `Config.network`."""

    tracked_score: float
    """The score from which on the target counts as tracked. Allowed: 0 to 1."""
    lost_score: float
    """The score below which the target counts as lost. Allowed: 0 to 1."""
    def __eq__(self, other: object, /) -> bool: ...

@final
class PatchModelConfig:
    """The settings of the patch model: `Config.robust.patches` or `Config.paper.patches`."""

    template_side: int
    """Side of the square templates, in samples. Allowed: 4 to 128."""
    large_patch: int
    """Side of a large patch, in samples. Allowed: 2 to 128."""
    large_step: int
    """Distance of neighbouring large patches, in samples. Allowed: 1 to 128."""
    small_patch: int
    """Side of a small patch, in samples. Allowed: 2 to 128."""
    small_step: int
    """Distance of neighbouring small patches, in samples. Allowed: 1 to 128."""
    subtract_mean: bool
    """Whether each patch's mean is subtracted before its norm is made 1. Allowed: true, false."""
    atoms: int
    """Maximum number of atoms in a joint code. Allowed: 1 to 8."""
    buffer: int
    """Number of earlier patches that are coded jointly with the current one. Allowed: 0 to 16."""
    min_residual: float
    """An atom is eligible while the squared norm of what the chosen atoms leave of it is at least
    this. Allowed: 0.0000001 to 0.1.
    """
    epsilon: float
    """A patch is visible when the squared error of its own-location code is below this. Allowed: 0
    to 4.
    """
    templates: int
    """Number of templates. Allowed: 2 to 40."""
    update_interval: int
    """Frames between updates of templates, large dictionary, large buffer and subspace. Allowed: 1
    to 10000.
    """
    small_update_interval: int
    """Frames between updates of the small dictionary and the small buffer. Allowed: 1 to 10000."""
    delta: float
    """Templates are updated when the visible shares of both scales add to more than twice this.
    Allowed: 0 to 1.
    """
    large_buffer_guard: float
    """The large buffer takes the candidate when more than this share of large patches is visible
    (o1). Allowed: 0 to 1.
    """
    small_buffer_guard: float
    """The small buffer takes the candidate when more than this share of small patches is visible
    (o2). Allowed: 0 to 1.
    """
    replacement_growth: float
    """The chance that a template is replaced grows by this factor from one to the next younger one.
    Allowed: 1 to 100.
    """
    forgetting: float
    """Weight of the past in the subspace when a batch comes in (1 forgets nothing). Allowed: 0.01
    to 1.
    """
    subspace_keep: float
    """Eigenvectors are kept while their squared singular value is at least this share of the total.
    Allowed: 0 to 1.
    """
    subspace_vectors: int
    """Maximum number of eigenvectors of the subspace. Allowed: 1 to 64."""
    lambda: float
    """Weight of the L1 norms in the reconstruction of the tracked candidate. Allowed: 0 to 1."""
    guided_radius: int
    """Radius of the guided filter that smooths the occlusion mask, in samples; 0 turns it off.
    Allowed: 0 to 32.
    """
    guided_epsilon: float
    """Regularisation of the guided filter. Allowed: 0.000000001 to 1."""
    def __eq__(self, other: object, /) -> bool: ...

@final
class Network:
    """A small tracking network from ONNX files, which the preset `network` follows with.

    Known are PatchNet (part of the package), NanoTrack (versions 2 and 3, a backbone and a head) and
    VitTrack (one file). Load it
    once and pass it to any number of trackers. Two networks are equal if their files are.

    A pickle does not hold the network but the full paths of its files, which must be unchanged
    where it is loaded again. A network made from bytes can't be pickled.

    Args:
        model: A folder with the ONNX files of one network, one file, a list of files, the bytes of
            one file or of a list of files, or `"patchnet"`, the network that is part of the package.
        runtime: What runs it: `None` for the built-in runtime, `"onnxruntime"` for the library of
            the installed package onnxruntime (`pip install "patchlock[onnxruntime]"`), or the path
            of another library of onnxruntime. A process uses one such library.

    Raises:
        ValueError: A file is damaged, too large or of no known family, or a file is missing.
        TypeError: `model` or `runtime` is none of these.
        OSError: A file can't be read.
        ImportError: `runtime` is `"onnxruntime"`, which is not installed.
    """

    def __new__(cls, model: ModelLike, *, runtime: str | os.PathLike[str] | None = None) -> Self: ...
    @property
    def name(self) -> str:
        """Its name, such as "NanoTrack v3"."""

    @property
    def hash(self) -> str:
        """The SHA-256 of its files, in hexadecimal; snapshots name their network by it."""

    @property
    def runtime(self) -> Literal["built-in", "onnxruntime"]:
        """What runs it: "built-in" or "onnxruntime"."""

    @property
    def paths(self) -> list[Path]:
        """The full paths that it was loaded from; empty if it was made from bytes."""

    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class ModelFile:
    """What an ONNX file is, read without running it.

    Args:
        file: The path of the file, or its bytes.

    Raises:
        ValueError: The file is damaged, too large or of no known family.
        OSError: The file can't be read.
    """

    def __new__(cls, file: str | os.PathLike[str] | bytes) -> Self: ...
    @property
    def family(self) -> str:
        """The family of networks that it belongs to, such as "NanoTrack"."""

    @property
    def part(self) -> str:
        """The part of the network that it holds, such as "head"."""

    @property
    def values(self) -> str:
        """Its inputs and outputs with their shapes."""

    @property
    def operators(self) -> int:
        """Number of operators."""

    @property
    def parameters(self) -> int:
        """Number of weights."""

    @property
    def sha256(self) -> str:
        """Its SHA-256, in hexadecimal."""

    @property
    def name(self) -> str | None:
        """The published network that it is a file of, such as "NanoTrack v3"; `None` if it is not a known file.
        """

    @property
    def origin(self) -> str | None:
        """Who publishes it, and where in the repository it is; `None` if it is not a known file."""

    @property
    def licence(self) -> str | None:
        """The licence that its publisher states; `None` if it is not a known file."""

    @property
    def training(self) -> str | None:
        """What it was trained on, and what that means for its use; `None` if it is not a known file.
        """


@final
class Tracker:
    """Follows one target through the frames of a video.

    It starts on the target: `estimate` is the first estimate, and `update` takes the frames after
    that.

    Frames are grey or colour arrays of uint8, uint16 or float32 with the shape (height, width) or
    (height, width, 3), or PIL images. Crops, frames with padding between rows and frames with
    reversed channels are read in place; arrays with other strides are copied. An array must not be
    modified while a call is using it.

    Each call releases the GIL, so trackers can run in parallel on several Python threads. One
    tracker processes one call at a time; a second thread waits. A tracker can be pickled or copied
    between two frames; the copy gives the same boxes. A pickle holds the paths of the network's
    files, not the network; see `Network`. In a process that was forked, with `os.fork` or by
    `multiprocessing`, a tracker continues where it was: a fork waits for calls of other threads.

    Args:
        frame: The first frame.
        box: The target in it: left, top, width, height in pixels, counted from 0; may be fractional
            and partly outside the frame. Width and height must be at least 1.
        config: A `Config`; `None` for the preset `robust`.
        preset: The name of a preset, instead of `config`.
        model: The network: a `Network`, what `Network` takes, or `"none"`. By default that of `config`, or
            else `"patchnet"` with `robust` and `network`.
        runtime: What runs the network, as for `Network`, if `model` is not a `Network`.
        threads: Number of threads for this tracker, 1 to 1024. `None` means one per core, in a pool
            that all such trackers of the process share. The number does not change the boxes.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV. PIL images carry
            their own order.
        settings: Settings to change, by name, such as `search=7`; `parameters()` describes them.

    Raises:
        TypeError: The frame is neither an array of a supported type nor an image, the box does not
            hold numbers, or a keyword argument is not a setting or has the wrong type.
        ValueError: The shape of the frame, the box, an argument or a setting is invalid, settings do not fit each
            other, or the network can't be used.
        OSError: A file of the network can't be read.
    """

    def __new__(
        cls,
        frame: FrameLike,
        box: BoxLike,
        config: Config | None = None,
        *,
        preset: str | None = None,
        model: Network | ModelLike | None = None,
        runtime: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        **settings: float | str | bool,
    ) -> Self: ...
    @property
    def estimate(self) -> Estimate:
        """The estimate for the latest frame; after the start, the one for the first frame."""

    def update(self, frame: FrameLike) -> Estimate:
        """Finds the target in the next frame and learns from it.

        Raises:
            TypeError: The frame is neither an array of a supported type nor an image.
            ValueError: The frame has an invalid shape, or its size differs from the first frame's.
                The tracker is unchanged.
        """

    def restart(self, frame: FrameLike, box: BoxLike) -> Estimate:
        """Starts again on the target in this box of this frame, which may have another size.

        What was learned before is forgotten. Use it to correct a track, or after the target was
        lost.

        Raises:
            TypeError: As for the constructor.
            ValueError: The shape of the frame or the box is invalid. The tracker is unchanged.
        """

    def update_observed(
        self, frame: FrameLike
    ) -> tuple[
        Estimate, PaperObservation | RobustObservation | NetworkObservation | CommitteeObservation
    ]:
        """Does the same as `update` and also returns what happened inside the tracker.

        The estimate is the same, but it takes longer: the method `paper` evaluates every particle
        completely, and the method `robust` computes its responses to the estimate again.

        Returns:
            The estimate and a `CommitteeObservation`, without a network a `RobustObservation`, with the
            method `paper` a `PaperObservation`, with `network` a `NetworkObservation`.

        Raises:
            TypeError: As for `update`.
            ValueError: As for `update`.
        """

    @property
    def config(self) -> Config:
        """A copy of the settings."""

    @property
    def threads(self) -> int | None:
        """Number of threads; `None` means one per core, shared by all such trackers."""

    @property
    def channels(self) -> Literal["rgb", "bgr"]:
        """Channel order of colour arrays: "rgb" or "bgr"."""

    def snapshot(self) -> bytes:
        """The complete state of the tracker, as JSON text.

        A tracker restored from it gives the same boxes. It has the hash of a network, not the network. The Rust library reads it as a `Snapshot`.
        """

    @classmethod
    def restore(
        cls,
        snapshot: bytes,
        *,
        model: Network | ModelLike | None = None,
        runtime: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        frame: int = 0,
    ) -> Self:
        """Restores a tracker from a snapshot.

        Args:
            snapshot: What `snapshot` returned.
            model: The network that the targets were tracked with, as for the constructor; not needed for
                `"patchnet"`. A snapshot holds its hash.
            runtime: As for the constructor.
            threads: As for the constructor.
            channels: As for the constructor.
            frame: Number of frames since the start when the snapshot was taken.

        Raises:
            ValueError: This is not a snapshot, its parts are inconsistent, or it needs another network.
            OSError: A file of the network can't be read.
        """

    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class MultiTracker:
    """Follows many targets through the frames of a video.

    Each target gets the boxes that a `Tracker` for it alone would give. Targets can be added and
    removed at any frame. Each frame is converted once for all targets, and all threads work on all
    targets. To add targets on a frame where others are already tracked, call `update` first and then
    `add`.

    Frames, threads, pickling and copying work as for `Tracker`. All targets share the same settings.

    Args:
        config: A `Config`; `None` for the preset `robust`.
        preset: The name of a preset, instead of `config`.
        model: The network: a `Network`, what `Network` takes, or `"none"`. By default that of `config`, or
            else `"patchnet"` with `robust` and `network`.
        runtime: What runs the network, as for `Network`, if `model` is not a `Network`.
        threads: Number of threads for this tracker, 1 to 1024. `None` means one per core, in a pool
            that all such trackers of the process share. The number does not change the boxes.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV. PIL images carry
            their own order.
        settings: Settings to change, by name, such as `search=7`; `parameters()` describes them.

    Raises:
        TypeError: `config` or `model` is none of these, or a keyword argument is not a setting or has
            the wrong type.
        ValueError: An argument or a setting is invalid, settings do not fit each other, or the network can't be
            used.
        OSError: A file of the network can't be read.
    """

    def __new__(
        cls,
        config: Config | None = None,
        *,
        preset: str | None = None,
        model: Network | ModelLike | None = None,
        runtime: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        **settings: float | str | bool,
    ) -> Self: ...
    def add(self, frame: FrameLike, box: BoxLike) -> tuple[int, Estimate]:
        """Adds the target in this box of this frame; returns its id and first estimate.

        Ids count from 1 and are never reused.

        Raises:
            TypeError: The frame is neither an array of a supported type nor an image, or the box does
                not hold numbers.
            ValueError: The box is invalid, or the frame's size differs from earlier frames'. The
                tracker is unchanged.
        """

    def restart(self, id: int, frame: FrameLike, box: BoxLike) -> Estimate:
        """Starts again with an existing target on a box of this frame.

        Use it to correct a track, or after the target was lost.

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
            ValueError: The frame has an invalid shape, or its size differs from earlier frames'. All
                targets are unchanged.
        """

    def update_observed(
        self, frame: FrameLike
    ) -> tuple[
        dict[int, Estimate], dict[int, PaperObservation | RobustObservation | NetworkObservation | CommitteeObservation]
    ]:
        """Does the same as `update` and also returns what happened inside the tracker.

        The estimates are the same, but it takes longer: targets are tracked one after another, each
        as `Tracker.update_observed` does it.

        Returns:
            The estimates, and for each id a `CommitteeObservation`, without a network a
            `RobustObservation`, with the method `paper` a `PaperObservation`, with `network` a
            `NetworkObservation`.

        Raises:
            TypeError: As for `update`.
            ValueError: As for `update`.
        """

    @property
    def ids(self) -> list[int]:
        """The ids of the targets, in the order in which they were added."""

    def __len__(self) -> int: ...
    @property
    def config(self) -> Config:
        """A copy of the settings."""

    @property
    def threads(self) -> int | None:
        """Number of threads; `None` means one per core, shared by all such trackers."""

    @property
    def channels(self) -> Literal["rgb", "bgr"]:
        """Channel order of colour arrays: "rgb" or "bgr"."""

    def snapshot(self) -> bytes:
        """The complete state of the tracker, as JSON text.

        A tracker restored from it gives the same boxes. It has the hash of a network, not the network. The Rust library reads it as a
        `MultiSnapshot`.
        """

    @classmethod
    def restore(
        cls,
        snapshot: bytes,
        *,
        model: Network | ModelLike | None = None,
        runtime: str | os.PathLike[str] | None = None,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        frame: int = 0,
    ) -> Self:
        """Restores a tracker from a snapshot.

        Args:
            snapshot: What `snapshot` returned.
            model: The network that the targets were tracked with, as for the constructor; not needed for
                `"patchnet"`. A snapshot holds its hash.
            runtime: As for the constructor.
            threads: As for the constructor.
            channels: As for the constructor.
            frame: Number of calls of `update` before the snapshot was taken.

        Raises:
            ValueError: This is not a snapshot, its parts are inconsistent, or it needs another network.
            OSError: A file of the network can't be read.
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

        With `track` it is the number in the source; with a tracker it counts from the first frame.
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

        With the methods `robust` and `network` it is an estimate of the probability that the box overlaps the
        target by at least half; that of a network is often too sure of what looks like the target. With `paper`
        it is the visible share of the target: the mean over both scales.
        """

    @property
    def status(self) -> Literal["tracked", "uncertain", "lost"]:
        """Whether the target is followed: "tracked", "uncertain" or "lost".

        While it is lost, the box and the corners are the last ones that were known; with the method `network`
        they are where the network is least unsure.
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
        is what is still followed, or the last known one, as with `--lost keep`.
        """

    def numbered(self, frame: int) -> Estimate:
        """A copy of the estimate with another frame number."""

    def draw(
        self, frame: FrameLike, *, channels: Literal["rgb", "bgr"] = "rgb"
    ) -> npt.NDArray[np.uint8]:
        """Draws the estimate on a copy of a frame.

        The lines are those of the command `patchlock track --video`: the upright box is white, the outline
        goes from orange to teal with the score, both are dashed while the target is uncertain. Of a lost target
        only the box is drawn, in grey: what is still followed, or the last known one.

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
class PaperObservation:
    """What the method `paper` computed on one frame; `Tracker.update_observed` returns it."""

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
        """The estimate's candidate, shape (side, side): warped to the template size, with unit norm.
        """

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
        """Frames since the start."""

    @property
    def phase(self) -> Literal["tracking", "occluded", "verifying", "lost"]:
        """What the filters do: "tracking"; "occluded", where hardly anything of the target is visible and it is
        also searched for elsewhere; "verifying" a re-detection; "lost", where it is only searched for.
        """

    @property
    def certainty(self) -> float:
        """How certain the memory is of the estimate: its response there over its mean on sure frames.
        """

    @property
    def elsewhere(self) -> float:
        """The memory's strongest response more than half the target's width or height away from the estimate.

        It is relative to the response at the estimate, from 0 to 2.
        """

    @property
    def early(self) -> float:
        """How sure the memory was when it had seen no more than the first sure frames.

        It is the response of what the memory was then, relative to its mean then.
        """

    @property
    def mean_elsewhere(self) -> float:
        """The running mean of `elsewhere` over the last frames, which the score counts."""

    @property
    def mean_early(self) -> float:
        """The running mean of `early` over the last frames, each from 0 to 1.5, which the score counts.
        """

    @property
    def contrast(self) -> float:
        """How well colour tells the target from what is around it: from -1 through 0, not at all, to 1.
        """

    @property
    def visible(self) -> float:
        """The visible share of the target, 0 to 1; 0 once the target is given up."""

    @property
    def mean_visible(self) -> float:
        """The running mean of the visible share over all frames, which the score counts."""

    @property
    def side(self) -> int:
        """Number of cells on a side of the search window around the estimate."""

    @property
    def cell(self) -> float:
        """Side of a cell, in pixels of the frame."""

    @property
    def tracking_filter(self) -> npt.NDArray[np.float32]:
        """The response of the tracking filter, shape (side, side).

        The entry [0, 0] is the centre of the estimate; entries further on are displacements down and to the
        right, those beyond half the side up and to the left. `numpy.fft.fftshift` puts the centre into the
        middle.
        """

    @property
    def memory(self) -> npt.NDArray[np.float32]:
        """The memory's response, shape (side, side), in the same order."""


@final
class NetworkObservation:
    """What the method `network` saw on one frame; `Tracker.update_observed` returns it."""

    @property
    def scores(self) -> npt.NDArray[np.float64]:
        """The score of each cell of the search window, 0 to 1, shape (cells, cells): the network's own; of
        PatchNet, a weighted mean of the network's and its classifier's.
        """

    @property
    def logits(self) -> npt.NDArray[np.float64]:
        """The logarithm of the odds that the network gives each cell, shape (cells, cells)."""

    @property
    def chosen(self) -> tuple[int, int]:
        """Row and column of the cell that was chosen."""

    @property
    def seen(self) -> Box:
        """The box `(x, y, w, h)` that the chosen cell saw, before its size was smoothed."""


@final
class CommitteeObservation:
    """What the default tracker and a network said on one frame, each for itself; `Tracker.update_observed`
    returns it.
    """

    @property
    def estimates(self) -> dict[str, Estimate]:
        """The estimate of each member by its name, `"filters"` and `"network"`.

        These have no visibility, and their frame is 0.
        """

    @property
    def observations(self) -> dict[str, RobustObservation | NetworkObservation]:
        """The observation of each member by its name: a `RobustObservation` and a `NetworkObservation`.
        """

    @property
    def judgements(self) -> dict[str, float | None]:
        """The logarithm of the odds that the other members give the box of each member, by its name.

        `None` where they agree with it or judge no boxes but their own.
        """

    @property
    def believed(self) -> list[str]:
        """The names of the members whose boxes make the box of the estimate."""

    @property
    def agrees(self) -> bool:
        """Whether the members agree on the place."""


@final
class Frames:
    """Iterates over the frames of a source with their numbers, decoding ahead on a thread. Of a live source,
    each step gives the newest frame.

    It yields pairs of a frame number and an array of shape (height, width) or (height, width, 3) in RGB
    order, uint8 or uint16 as in the source.

    A process that was forked after frames were opened can't read on: iterating is a `RuntimeError` there.

    Args:
        source: Any source that the command accepts: a folder of images, a pattern such as
            `"img/%04d.jpg"`, a glob, an MP4 (H.264) or Y4M file, any other video if `ffmpeg` is installed, or
            `"-"` for Y4M on standard input. A number is a camera of this machine, and an address such as
            `"rtsp://host/path"` a live stream; `ffmpeg` opens both.
        start: Number of the first frame of the range.
        end: Number of the first frame after the range; `None` for the end of the source.
        stride: Take every `stride`-th frame.
        reverse: Go from the last frame of the range to the first.
        max_pixels: Most pixels of a frame, width times height. A source that claims more is refused before
            memory is taken for it.
        reconnect: Seconds to wait in all, between attempts to open a live stream that was lost; with 0, the
            frames end there.

    Raises:
        ValueError: The range contains no frame, or the source is live and has no such range.
        OSError: The source can't be read; `FileNotFoundError` if it does not exist.
    """

    def __new__(
        cls,
        source: str | os.PathLike[str] | int,
        *,
        start: int = 0,
        end: int | None = None,
        stride: int = 1,
        reverse: bool = False,
        max_pixels: int = 36_000_000,
        reconnect: float = 60.0,
    ) -> Self: ...
    @property
    def count(self) -> int | None:
        """Number of frames in the range; `None` if it is not known in advance."""

    @property
    def dropped(self) -> int:
        """Frames of a live source that were left out so far because a newer one had come; 0 for others.
        """

    @property
    def rate(self) -> float | None:
        """Frames per second of the source; `None` if the source does not say, or is live."""

    @property
    def time(self) -> float | None:
        """When the latest frame is shown, in seconds from the first frame of the source; `None` before the first
        frame and if the source has no times.
        """

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
        video: The video file or folder of images. Needed to begin a project; without it the file must exist,
            and the video that it names is read only if it is in the folder of the file.
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

    def attributes(self, target: int, frame: int | None = None) -> dict[str, str]:
        """The attributes of a target.

        Without `frame`, those that were set for the whole target. With it, all that hold in the frame, also
        those that change and the defaults of its label.
        """

    def keys(self, target: int) -> dict[int, dict[str, Any]]:
        """The boxes that a person has drawn, by frame.

        Each is a dictionary with `box`, `occluded`, `truncated` and, if one was drawn, `outline`.
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

    def add_target(
        self,
        label: str,
        frame: int,
        box: BoxLike | None = None,
        *,
        outline: Iterable[Iterable[float]] | None = None,
    ) -> int:
        """Adds a target with one key frame. A label that does not exist is added.

        `outline` is a polygon around the target, of at least three points x, y; pixel `k` is from `k` to
        `k + 1`. A rotated box has four. The box is then the upright one around it, and need not be given.

        Returns:
            The id of the target.

        Raises:
            ValueError: The frame is not in the video, or the box or the outline is not possible.
        """

    def set_key(
        self,
        target: int,
        frame: int,
        box: BoxLike | None = None,
        *,
        outline: Iterable[Iterable[float]] | None = None,
        occluded: bool = False,
        truncated: bool = False,
    ) -> None:
        """Draws the box or the outline of a target in a frame, as `add_target` takes them. The frame becomes a
        key frame.

        Raises:
            ValueError: There is no such target, or the frame, the box or the outline is not possible.
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
        self,
        file: str | os.PathLike[str],
        format: Literal["csv", "mot", "cvat", "coco", "label-studio", "yolo", "voc"],
    ) -> list[int]:
        """Adds the targets of a file of another tool, or of a table.

        A warning says what was left out, and how images were matched with frames if not by their names.

        Args:
            file: The file to read; for yolo and voc the folder of the files, which may be in folders of it.
            format: `"csv"` (also JSON lines), `"mot"`, `"cvat"`, `"coco"` (also results of
                detectors), `"label-studio"`, `"yolo"` or `"voc"`.

        Returns:
            The ids of the new targets.

        Raises:
            ValueError: The file has another format, or boxes that are not possible.
            OSError: The file can't be read.
        """

    def export(
        self,
        format: str,
        out: str | os.PathLike[str],
        *,
        frames: bool = False,
        name: str | None = None,
        status: str | Sequence[str] | None = None,
        min_score: float | None = None,
        every: int = 1,
        key_frames: float = 1.0,
        overwrite: bool = False,
    ) -> int:
        """Writes the project in the format of another tool, or as a table.

        Files are written completely or not at all.

        Args:
            format: A format of `patchlock.export`, or `"csv"`.
            out: The file or folder to create. A folder must be empty or not exist yet.
            frames: Copy the frames into formats that include them.
            name: Name of the video; `None` for that of its file.
            status: As in `patchlock.export`.
            min_score: As in `patchlock.export`.
            every: As in `patchlock.export`.
            key_frames: As in `patchlock.export`.
            overwrite: Replace an existing file. A folder that is not empty is never replaced.

        Returns:
            The number of files written.

        Raises:
            ValueError: There are no boxes, there is no such format, `out` exists, or frames are needed of a
                video that only the project file names, and not in its folder.
            OSError: A file can't be read or written.
        """

    def save(self) -> None:
        """Writes the file, whole or not at all.

        Raises:
            OSError: It can't be written, another program has the project open, or has changed the file since
                it was read.
        """


@final
class VideoWriter:
    """Writes a video with the track drawn in (MP4, H.264), as `patchlock track --video` does.

    ```python
    scene = patchlock.Scene("simple")            # your frames
    tracker = patchlock.Tracker(scene[0], scene.truth(0))
    with patchlock.VideoWriter("tracked.mp4", rate=25) as video:
        video.write(scene[0], tracker.estimate)
        for k in range(1, 8):
            video.write(scene[k], tracker.update(scene[k]))
    ```

    `track(..., video="tracked.mp4")` does so for its frames. The file appears when the writer is closed, at
    the end of `with`, also after an exception: it then has the frames up to there. Without frames there is no
    file. If ffmpeg with libx264 is installed, it encodes long videos.

    Args:
        file: The file, whose name ends in `.mp4`.
        rate: Frames per second, 0.001 to 1000, of frames without a time.
        count: Number of frames, if it is known: players can then start before they have the whole file.
        panel: Whether to draw panels with score, frame number and visible patches, which avoid the target.
        quality: Quantiser, from 0 (best picture, largest file) to 51; 6 more roughly halve the size.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV.
        overwrite: Replace an existing file.

    Raises:
        ValueError: An argument is invalid, or the file exists.
        OSError: The file can't be written.
    """

    def __new__(
        cls,
        file: str | os.PathLike[str],
        *,
        rate: float = 30.0,
        count: int | None = None,
        panel: bool = True,
        quality: int = 26,
        channels: Literal["rgb", "bgr"] = "rgb",
        overwrite: bool = False,
    ) -> Self: ...
    def write(
        self,
        frame: FrameLike,
        estimates: Estimate | Mapping[int, Estimate],
        *,
        time: float | None = None,
    ) -> None:
        """Draws a frame with its estimates and adds it.

        Args:
            frame: The frame, as for `Tracker`; all have the same size.
            estimates: The estimate of the frame, or of many targets one for each id, as `MultiTracker.update`
                returns them. `Estimate.frame` is the number that is drawn.
            time: When the frame is shown, in seconds; if it and the next frame have a time, the frame lasts from
                one to the other. `None` for the time by `rate`.

        Raises:
            TypeError: The frame is neither an array of a supported type nor an image, or the estimates are none.
            ValueError: The frame has an invalid shape or another size than the first, or the video is closed.
            OSError: The video can't be written; it is then abandoned.
        """

    def close(self) -> None:
        """Completes the file. A closed video can be closed again.

        Raises:
            OSError: The file can't be written.
        """

    def __enter__(self) -> Self: ...
    def __exit__(self, *_exception: object) -> None: ...

@final
class Store:
    """The results folder of one tracker, with runs in the format of `patchlock bench`."""

    def __new__(
        cls,
        out: str | os.PathLike[str],
        name: str | None,
        *,
        config: Config,
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
        video: str | os.PathLike[str] | None = None,
    ) -> str:
        """Describes the run on a clip as a JSON message.

        `source` is recorded in the manifest; `path` locates the clip from any working directory, and
        `video` the video that is drawn of it.
        """

    def holds(self, job: str) -> bool:
        """Whether the complete run is already stored, with its video, if there is to be one."""

    def keep(self, job: str, boxes: str, manifest: str) -> None:
        """Stores the two files of a run."""


def track_job(job: str) -> tuple[str, str]:
    """Performs a run; returns its boxes as text and its manifest. Its video is then complete."""


def abandon_files() -> None:
    """Removes the parts of files that this process writes. It must end after this."""


def bench_jobs(
    dataset: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    protocol: str,
    preset: str,
    file: str | os.PathLike[str] | None,
    model: str | os.PathLike[str] | None,
    runtime: str | os.PathLike[str] | None,
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


def parameters(research: bool = False) -> list[tuple[str, str, int | float | str | bool, str, str, str]]:
    """The rows of the table of settings: group, name, default, allowed values, source, purpose."""


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
    status: str | Sequence[str] | None,
    min_score: float | None,
    every: int,
    key_frames: float,
    overwrite: bool,
) -> int:
    """Writes a track in another format; returns the number of files written."""

def _export_formats() -> list[tuple[str, str]]:
    """The names of all formats, each with what it writes."""


def _checked_config(
    config: Config | None,
    preset: str | None,
    model: Network | ModelLike | None,
    runtime: str | os.PathLike[str] | None,
    settings: Mapping[str, float | str | bool] | None = None,
    arguments: Sequence[str] | None = None,
) -> Config:
    """A copy of settings that fit each other, with the network that the method needs. Settings by name
    are keyword arguments of a function that has these `arguments`, too.
    """

def _box(numbers: BoxLike, corners: bool = False) -> Box:
    """A box of any four numbers: left, top, width, height or, with `corners`, left, top, right, bottom.
    """

def _iou(one: BoxLike, other: BoxLike) -> float:
    """Intersection over union of two boxes of any four numbers."""

def _read_estimates(file: str | os.PathLike[str]) -> list[tuple[int, Estimate]]:
    """The ids and estimates of a table, ordered by frame, then by id."""

def _restore_config(
    preset: str, changes: dict[str, int | float | str | bool], model: Network | None = None
) -> Config:
    """Called by pickle."""

def _restore_many(
    snapshot: bytes, threads: int | None, channels: str, frame: int, model: Network | None = None
) -> MultiTracker:
    """Called by pickle."""

def _restore_network(
    paths: Sequence[str | os.PathLike[str]], runtime: str | os.PathLike[str] | None, hash: str
) -> Network:
    """Called by pickle."""


def _select_boxes(
    frame: FrameLike,
    channels: str,
    in_notebook: bool,
    port: int,
    host: str | None,
    opened: Callable[[str, str], None],
) -> list[tuple[float, float, float, float]]:
    """Serves a page with the frame until a person has drawn a box there. `host` is the host of the
    address at which a proxy serves the page. `opened` is called with the address of the page and one
    for the arguments of a browser, which works once.
    """


def _restore(
    snapshot: bytes, threads: int | None, channels: str, frame: int, model: Network | None = None
) -> Tracker:
    """Called by pickle."""
