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
    def model(self) -> Network | None: ...
    robust: RobustConfig
    """The settings of the method `robust`; only with its presets."""
    paper: PaperConfig
    """The settings of the method `paper`; only with its preset."""
    network: NetworkConfig
    """The settings of the method `network`; only with its preset."""

    def to_dict(self) -> dict[str, Any]: ...
    def __eq__(self, other: object, /) -> bool: ...

@final
class RobustConfig:
    patches: PatchModelConfig
    """The settings of the patch model."""

    def __eq__(self, other: object, /) -> bool: ...

@final
class PaperConfig:
    patches: PatchModelConfig
    """The settings of the patch model."""

    def __eq__(self, other: object, /) -> bool: ...

@final
class NetworkConfig:
    def __eq__(self, other: object, /) -> bool: ...

@final
class PatchModelConfig:
    def __eq__(self, other: object, /) -> bool: ...

@final
class Network:
    def __new__(cls, model: ModelLike, *, runtime: str | os.PathLike[str] | None = None) -> Self: ...
    @property
    def name(self) -> str: ...
    @property
    def hash(self) -> str: ...
    @property
    def runtime(self) -> Literal["built-in", "onnxruntime"]: ...
    @property
    def paths(self) -> list[Path]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __copy__(self) -> Self: ...
    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class ModelFile:
    def __new__(cls, file: str | os.PathLike[str] | bytes) -> Self: ...
    @property
    def family(self) -> str: ...
    @property
    def part(self) -> str: ...
    @property
    def values(self) -> str: ...
    @property
    def operators(self) -> int: ...
    @property
    def parameters(self) -> int: ...
    @property
    def sha256(self) -> str: ...
    @property
    def name(self) -> str | None: ...
    @property
    def origin(self) -> str | None: ...
    @property
    def licence(self) -> str | None: ...
    @property
    def training(self) -> str | None: ...

@final
class Tracker:
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
    def estimate(self) -> Estimate: ...
    def update(self, frame: FrameLike) -> Estimate: ...
    def restart(self, frame: FrameLike, box: BoxLike) -> Estimate: ...
    def update_observed(
        self, frame: FrameLike
    ) -> tuple[
        Estimate, PaperObservation | RobustObservation | NetworkObservation | CommitteeObservation
    ]: ...
    @property
    def config(self) -> Config: ...
    @property
    def threads(self) -> int | None: ...
    @property
    def channels(self) -> Literal["rgb", "bgr"]: ...
    def snapshot(self) -> bytes: ...
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
    ) -> Self: ...
    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class MultiTracker:
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
    def add(self, frame: FrameLike, box: BoxLike) -> tuple[int, Estimate]: ...
    def restart(self, id: int, frame: FrameLike, box: BoxLike) -> Estimate: ...
    def remove(self, id: int) -> None: ...
    def update(self, frame: FrameLike) -> dict[int, Estimate]: ...
    def update_observed(
        self, frame: FrameLike
    ) -> tuple[
        dict[int, Estimate], dict[int, PaperObservation | RobustObservation | NetworkObservation | CommitteeObservation]
    ]: ...
    @property
    def ids(self) -> list[int]: ...
    def __len__(self) -> int: ...
    @property
    def config(self) -> Config: ...
    @property
    def threads(self) -> int | None: ...
    @property
    def channels(self) -> Literal["rgb", "bgr"]: ...
    def snapshot(self) -> bytes: ...
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
    ) -> Self: ...
    def __deepcopy__(self, _memo: dict[int, Any], /) -> Self: ...

@final
class Estimate:
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
    def frame(self) -> int: ...
    @property
    def ms(self) -> float: ...
    @property
    def box(self) -> Box: ...
    @property
    def corners(self) -> npt.NDArray[np.float64]: ...
    @property
    def score(self) -> float: ...
    @property
    def status(self) -> Literal["tracked", "uncertain", "lost"]: ...
    @property
    def visibility(self) -> Visibility | None: ...
    def to_dict(self) -> dict[str, float | str | None]: ...
    def numbered(self, frame: int) -> Estimate: ...
    def draw(
        self, frame: FrameLike, *, channels: Literal["rgb", "bgr"] = "rgb"
    ) -> npt.NDArray[np.uint8]: ...
    def __eq__(self, other: object, /) -> bool: ...

@final
class PaperObservation:
    @property
    def particles(self) -> npt.NDArray[np.float64]: ...
    @property
    def likelihoods(self) -> npt.NDArray[np.float64]: ...
    @property
    def best(self) -> int: ...
    @property
    def candidate(self) -> npt.NDArray[np.float32]: ...
    @property
    def templates(self) -> npt.NDArray[np.float32]: ...
    @property
    def replaced(self) -> int | None: ...
    @property
    def mask(self) -> npt.NDArray[np.float64] | None: ...

@final
class RobustObservation:
    @property
    def frame(self) -> int: ...
    @property
    def phase(self) -> Literal["tracking", "occluded", "verifying", "lost"]: ...
    @property
    def certainty(self) -> float: ...
    @property
    def elsewhere(self) -> float: ...
    @property
    def early(self) -> float: ...
    @property
    def mean_elsewhere(self) -> float: ...
    @property
    def mean_early(self) -> float: ...
    @property
    def contrast(self) -> float: ...
    @property
    def visible(self) -> float: ...
    @property
    def mean_visible(self) -> float: ...
    @property
    def side(self) -> int: ...
    @property
    def cell(self) -> float: ...
    @property
    def tracking_filter(self) -> npt.NDArray[np.float32]: ...
    @property
    def memory(self) -> npt.NDArray[np.float32]: ...

@final
class NetworkObservation:
    @property
    def scores(self) -> npt.NDArray[np.float64]: ...
    @property
    def logits(self) -> npt.NDArray[np.float64]: ...
    @property
    def chosen(self) -> tuple[int, int]: ...
    @property
    def seen(self) -> Box: ...

@final
class CommitteeObservation:
    @property
    def estimates(self) -> dict[str, Estimate]: ...
    @property
    def observations(self) -> dict[str, RobustObservation | NetworkObservation]: ...
    @property
    def judgements(self) -> dict[str, float | None]: ...
    @property
    def believed(self) -> list[str]: ...
    @property
    def agrees(self) -> bool: ...

@final
class Frames:
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
    def count(self) -> int | None: ...
    @property
    def dropped(self) -> int: ...
    @property
    def rate(self) -> float | None: ...
    @property
    def time(self) -> float | None: ...
    def __iter__(self) -> Self: ...
    def __next__(self) -> tuple[int, npt.NDArray[np.uint8] | npt.NDArray[np.uint16]]: ...

@final
class Scene:
    def __new__(cls, name: Literal["demo", "simple", "occluded"] = "demo") -> Self: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> npt.NDArray[np.uint8]: ...
    def truth(self, index: int) -> Box: ...
    def hidden(self, index: int) -> float: ...

@final
class Project:
    def __new__(
        cls,
        path: str | os.PathLike[str],
        video: str | os.PathLike[str] | None = None,
        *,
        max_pixels: int = 36_000_000,
    ) -> Self: ...
    @property
    def path(self) -> Path: ...
    @property
    def video(self) -> Path: ...
    @property
    def frames(self) -> int: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def changed(self) -> str | None: ...
    @property
    def done(self) -> bool: ...
    @done.setter
    def done(self, done: bool) -> None: ...
    @property
    def labels(self) -> list[tuple[str, str]]: ...
    @property
    def targets(self) -> list[int]: ...
    def label(self, target: int) -> str: ...
    def attributes(self, target: int, frame: int | None = None) -> dict[str, str]: ...
    def keys(self, target: int) -> dict[int, dict[str, Any]]: ...
    def tracked(self, target: int) -> dict[int, dict[str, Any]]: ...
    def boxes(self, target: int) -> dict[int, Box]: ...
    def hidden(self, target: int) -> list[tuple[int, int]]: ...
    def add_target(
        self,
        label: str,
        frame: int,
        box: BoxLike | None = None,
        *,
        outline: Iterable[Iterable[float]] | None = None,
    ) -> int: ...
    def set_key(
        self,
        target: int,
        frame: int,
        box: BoxLike | None = None,
        *,
        outline: Iterable[Iterable[float]] | None = None,
        occluded: bool = False,
        truncated: bool = False,
    ) -> None: ...
    def set_tracked(self, target: int, estimates: Iterable[Estimate]) -> None: ...
    def hide(self, target: int, first: int, last: int) -> None: ...
    def delete_target(self, target: int) -> None: ...
    def edit(self, edits: Sequence[Mapping[str, Any]]) -> None: ...
    def undo(self) -> bool: ...
    def redo(self) -> bool: ...
    def import_file(
        self,
        file: str | os.PathLike[str],
        format: Literal["csv", "mot", "cvat", "coco", "label-studio", "yolo", "voc"],
    ) -> list[int]: ...
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
    ) -> int: ...
    def save(self) -> None: ...

@final
class VideoWriter:
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
    ) -> None: ...
    def close(self) -> None: ...
    def __enter__(self) -> Self: ...
    def __exit__(self, *_exception: object) -> None: ...

@final
class Store:
    def __new__(
        cls,
        out: str | os.PathLike[str],
        name: str | None,
        *,
        config: Config,
        own: dict[str, Any],
    ) -> Self: ...
    @property
    def folder(self) -> Path: ...
    @property
    def first_seed(self) -> int: ...
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
    ) -> str: ...
    def holds(self, job: str) -> bool: ...
    def keep(self, job: str, boxes: str, manifest: str) -> None: ...

def track_job(job: str) -> tuple[str, str]: ...

def abandon_files() -> None: ...

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
) -> tuple[Store, list[tuple[str, str, str]], int, list[tuple[str, str, str]]]: ...

def read_truth(path: str | os.PathLike[str]) -> list[tuple[float, float, float, float] | None]: ...

def parameters(research: bool = False) -> list[tuple[str, str, int | float | str | bool, str, str, str]]: ...

def run(args: list[str]) -> int: ...

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
) -> int: ...
def _export_formats() -> list[tuple[str, str]]: ...

def _checked_config(
    config: Config | None,
    preset: str | None,
    model: Network | ModelLike | None,
    runtime: str | os.PathLike[str] | None,
    settings: Mapping[str, float | str | bool] | None = None,
    arguments: Sequence[str] | None = None,
) -> Config: ...
def _box(numbers: BoxLike, corners: bool = False) -> Box: ...
def _iou(one: BoxLike, other: BoxLike) -> float: ...
def _read_estimates(file: str | os.PathLike[str]) -> list[tuple[int, Estimate]]: ...
def _restore_config(
    preset: str, changes: dict[str, int | float | str | bool], model: Network | None = None
) -> Config: ...
def _restore_many(
    snapshot: bytes, threads: int | None, channels: str, frame: int, model: Network | None = None
) -> MultiTracker: ...
def _restore_network(
    paths: Sequence[str | os.PathLike[str]], runtime: str | os.PathLike[str] | None, hash: str
) -> Network: ...

def _select_boxes(
    frame: FrameLike,
    channels: str,
    in_notebook: bool,
    port: int,
    host: str | None,
    opened: Callable[[str, str], None],
) -> list[tuple[float, float, float, float]]: ...

def _restore(
    snapshot: bytes, threads: int | None, channels: str, frame: int, model: Network | None = None
) -> Tracker: ...
