"""Small values that the tracker gives and takes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, Union

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from PIL.Image import Image

# Pillow may not be there when this runs, and a name alone does not take `|`.
FrameLike: TypeAlias = Union[npt.NDArray[np.uint8], npt.NDArray[np.uint16], npt.NDArray[np.float32], "Image"]
"""A frame: an array of shape (height, width) or (height, width, 3), or a PIL image."""

BoxLike: TypeAlias = Sequence[float] | npt.NDArray[np.floating[Any] | np.integer[Any]]
"""Four numbers: left, top, width, height in pixels, counted from 0."""


class Box(NamedTuple):
    """An upright box in pixels, counted from 0, with fractions; pixel centres lie at whole numbers."""

    x: float
    """Column of its first pixel."""
    y: float
    """Row of its first pixel."""
    w: float
    """Width in pixels."""
    h: float
    """Height in pixels."""


class Visibility(NamedTuple):
    """Shares of the target's patches that are visible, each from 0 to 1."""

    large: float
    """Of the large patches."""
    small: float
    """Of the small patches."""


class Occlusion(NamedTuple):
    """Which of the target's patches are hidden, row by row in the target's own frame of reference."""

    large: npt.NDArray[np.bool_]
    """Of the large patches; 3 x 3 with the preset `paper`."""
    small: npt.NDArray[np.bool_]
    """Of the small patches; 13 x 13 with the preset `paper`."""


class Parameter(NamedTuple):
    """One row of the table of settings."""

    name: str
    """Its name, as a keyword of `Tracker` and in a configuration file."""
    default: float | str | bool
    """Its value in the preset `paper`."""
    allowed: str
    """The values that it may take."""
    section: str
    """Where the paper has it."""
    purpose: str
    """What it does."""
