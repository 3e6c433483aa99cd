import os
from collections.abc import Sequence
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
    "PRESETS",
    "Scene",
    "Tracker",
    "__version__",
    "_restore",
    "parameters",
    "run",
]

PRESETS: Final[list[str]]

@final
class Tracker:
    def __new__(
        cls,
        preset: str = "paper",
        *,
        threads: int | None = None,
        channels: Literal["rgb", "bgr"] = "rgb",
        **overrides: Unpack[Settings],
    ) -> Self: ...
    def init(self, frame: FrameLike, box: BoxLike) -> Estimate: ...
    def update(self, frame: FrameLike) -> Estimate: ...
    @property
    def config(self) -> dict[str, int | float | str | bool]: ...
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
        likelihood: float,
        occlusion: tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]],
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
    def likelihood(self) -> float: ...
    @property
    def visibility(self) -> Visibility: ...
    @property
    def occlusion(self) -> Occlusion: ...
    def to_dict(self) -> dict[str, float]: ...
    def numbered(self, frame: int) -> Estimate: ...
    def __eq__(self, other: object, /) -> bool: ...

@final
class Frames:
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
    def count(self) -> int | None: ...
    @property
    def rate(self) -> float | None: ...
    def __iter__(self) -> Self: ...
    def __next__(self) -> tuple[int, npt.NDArray[np.uint8] | npt.NDArray[np.uint16]]: ...

@final
class Scene:
    def __new__(cls, name: Literal["demo", "simple", "occluded"] = "demo") -> Self: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> npt.NDArray[np.uint8]: ...
    def truth(self, index: int) -> Box: ...
    def hidden(self, index: int) -> float: ...

def parameters() -> list[tuple[str, int | float | str | bool, str, str, str]]: ...
def run(args: list[str]) -> int: ...
def _restore(snapshot: bytes, threads: int | None, channels: str, frame: int) -> Tracker: ...
