"""Small types that the tracker accepts and returns."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from patchlock import _patchlock

if TYPE_CHECKING:
    from PIL.Image import Image
    from typing_extensions import Self

# Pillow is optional, so its type is a string here, and a string does not support `|`.
FrameLike: TypeAlias = Union[npt.NDArray[np.uint8], npt.NDArray[np.uint16], npt.NDArray[np.float32], "Image"]
"""A frame: an array of shape (height, width) or (height, width, 3), or a PIL image."""

BoxLike: TypeAlias = Sequence[float] | npt.NDArray[np.floating[Any] | np.integer[Any]]
"""Four numbers: left, top, width, height in pixels, counted from 0."""

ModelLike: TypeAlias = Union[
    str, "os.PathLike[str]", bytes, Sequence[Union[str, "os.PathLike[str]"]], Sequence[bytes]
]
"""The files of a network: a folder, a file, a list of files, or the bytes of one or of a list of files."""


class Box(NamedTuple):
    """An upright box in pixels, counted from 0; may be fractional. Pixel centres are at whole numbers.

    ```python
    box = patchlock.Box.from_xyxy([30, 20, 70, 50])    # a row of detections, a list, a tuple
    assert box.xywh == (30, 20, 40, 30) and box.iou((50, 20, 40, 30)) == 1 / 3
    ```
    """

    x: float
    """Column of the first pixel."""
    y: float
    """Row of the first pixel."""
    w: float
    """Width in pixels."""
    h: float
    """Height in pixels."""

    @classmethod
    def from_xywh(cls, numbers: BoxLike) -> Self:
        """The box of any four numbers: left, top, width, height.

        Raises:
            TypeError: These are not numbers.
            ValueError: These are not four numbers.
        """
        return cls(*_patchlock._box(numbers))

    @classmethod
    def from_xyxy(cls, numbers: BoxLike) -> Self:
        """The box of any four numbers: left, top, right, bottom, as most detectors have them.

        Raises:
            TypeError: These are not numbers.
            ValueError: These are not four numbers, or the right or bottom edge is before the other one.
        """
        return cls(*_patchlock._box(numbers, corners=True))

    @property
    def xywh(self) -> tuple[float, float, float, float]:
        """Left, top, width, height."""
        return self.x, self.y, self.w, self.h

    @property
    def xyxy(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom; the right and bottom edges are `x + w` and `y + h`."""
        return self.x, self.y, self.x + self.w, self.y + self.h

    def iou(self, other: BoxLike) -> float:
        """Intersection over union with another box, 0 to 1; of any four numbers x, y, w, h."""
        return _patchlock._iou(self, other)

    def __str__(self) -> str:
        """For reading: two digits after the point, while `repr` has all of them."""
        return f"Box(x={self.x:.2f}, y={self.y:.2f}, w={self.w:.2f}, h={self.h:.2f})"


class Visibility(NamedTuple):
    """Which of the target's patches are visible, in row order of the unrotated target."""

    large: npt.NDArray[np.bool_]
    """The large patches; 3 x 3 by default."""
    small: npt.NDArray[np.bool_]
    """The small patches; 7 x 7 by default, 13 x 13 with the preset `paper`."""

    @property
    def shares(self) -> tuple[float, float]:
        """Shares of the large and of the small patches that are visible, each 0 to 1."""
        return float(self.large.mean()), float(self.small.mean())


class Parameter(NamedTuple):
    """One row of the table of settings."""

    group: str
    """The group in `Config`: `robust`, `paper`, `network`, or `patches` in the first two; empty for `seed`."""
    name: str
    """Name of the setting, in `Config` and in a settings file."""
    default: float | str | bool
    """Value in the preset `robust`, or in `paper` or `network` for the settings of that method."""
    allowed: str
    """Allowed values: a range or a list."""
    source: str
    """Where the value comes from: a section of the paper, other work, or our own choice."""
    purpose: str
    """What the setting does."""


def parameters(*, research: bool = False) -> list[Parameter]:
    """The table of the settings, one row per setting, group by group.

    Args:
        research: Also the numbers of research, which change without notice from one version to the next.
    """
    return [Parameter(*row) for row in _patchlock.parameters(research)]
