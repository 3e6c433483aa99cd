"""A tracker in the shape of OpenCV's, so that a script changes one line.

```python
tracker = cv2.TrackerCSRT_create()                 # before
tracker = patchlock.toolkits.cv2.TrackerPatchlock_create()    # after

tracker.init(frame, (120, 80, 64, 48))
ok, box = tracker.update(frame)
```

OpenCV itself is not needed here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from patchlock._patchlock import Estimate, Tracker

if TYPE_CHECKING:
    from typing import TypeAlias

    import numpy as np
    import numpy.typing as npt
    from typing_extensions import Unpack

    from patchlock._settings import Settings
    from patchlock._types import BoxLike

    _Box: TypeAlias = tuple[int, int, int, int] | tuple[float, float, float, float]
    _Image: TypeAlias = npt.NDArray[np.uint8] | npt.NDArray[np.uint16] | npt.NDArray[np.float32]

__all__ = ["TrackerPatchlock", "TrackerPatchlock_create"]


class TrackerPatchlock:
    """Follows one target, with the methods of `cv2.Tracker`.

    Images are numpy arrays as `cv2.imread` and `cv2.VideoCapture` give them: blue first, or grey. Boxes are left, top, width, height in pixels,
    counted from 0.

    Unlike OpenCV's trackers it may be given a second `init`, takes boxes with fractions or partly outside the image, and refuses what it can't track with
    `ValueError` or `TypeError` instead of a crash.

    Args:
        preset: The set of settings to begin with.
        min_score: `update` says `ok` where the score is at least this, 0 to 1. The score is the visible share of the target; its usual height
            differs from target to target.
        exact: `False` rounds boxes to whole pixels, as OpenCV's trackers do, so that drawing takes them; `True` keeps their fractions.
        threads: Number of threads; `None` for one for each core. The boxes are the same for any number.
        **overrides: Settings that differ from the preset, such as `particles=300`; `patchlock.parameters()` lists all.
    """

    def __init__(
        self,
        preset: str = "paper",
        *,
        min_score: float = 0.1,
        exact: bool = False,
        threads: int | None = None,
        **overrides: Unpack[Settings],
    ) -> None:
        if not 0 <= min_score <= 1:
            raise ValueError(f"min_score is {min_score}; allowed: 0 to 1")
        self._tracker = Tracker(preset, threads=threads, channels="bgr", **overrides)
        self._min_score = min_score
        self._exact = exact
        self._estimate: Estimate | None = None

    @classmethod
    def create(cls, *args: Any, **kwargs: Any) -> TrackerPatchlock:
        """The same as the class itself, as `cv2.TrackerMIL.create()` is."""
        return cls(*args, **kwargs)

    def init(self, image: _Image, boundingBox: BoxLike) -> None:
        """Begins on the target in a box of an image; a target so far is forgotten.

        Args:
            image: Array of shape (height, width, 3), blue first, or (height, width).
            boundingBox: Left, top, width, height.

        Raises:
            TypeError: Where the image or the box is none.
            ValueError: Where the box does not cover a part of the image.
        """
        self._estimate = self._tracker.init(image, boundingBox)

    def update(self, image: _Image) -> tuple[bool, _Box]:
        """Finds the target in the next image.

        Args:
            image: As for `init`, and of the same size.

        Returns:
            Whether the target is seen (the score is at least `min_score` and the middle of the box is in the image), and the box. The box is the best guess
            also where it is not seen.

        Raises:
            RuntimeError: Before `init`.
        """
        self._estimate = estimate = self._tracker.update(image)
        x, y, w, h = estimate.box
        height, width = image.shape[:2]
        inside = 0 <= x + (w - 1) / 2 < width and 0 <= y + (h - 1) / 2 < height
        ok = estimate.score >= self._min_score and inside
        return ok, (x, y, w, h) if self._exact else (_round(x), _round(y), _round(w), _round(h))

    def getTrackingScore(self) -> float:
        """The score of the last image, 0 to 1, as some of OpenCV's trackers have it.

        Raises:
            RuntimeError: Before `init`.
        """
        if self._estimate is None:
            raise RuntimeError("the tracker has no target yet: call init(image, box) first")
        return self._estimate.score

    @property
    def estimate(self) -> Estimate | None:
        """All that is known of the last image: corners, visibility, hidden patches; `None` before `init`."""
        return self._estimate


def TrackerPatchlock_create(*args: Any, **kwargs: Any) -> TrackerPatchlock:
    """The same as `TrackerPatchlock`, named as OpenCV names such functions."""
    return TrackerPatchlock(*args, **kwargs)


def _round(value: float) -> int:
    return math.floor(value + 0.5)
