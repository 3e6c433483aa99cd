"""A tracker with the interface of OpenCV's trackers, so that only one line of a script changes.

```python
tracker = cv2.TrackerCSRT_create()                 # before
tracker = patchlock.toolkits.cv2.TrackerPatchlock_create()    # after

tracker.init(frame, (120, 80, 64, 48))
ok, box = tracker.update(frame)
```

OpenCV itself is not required.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from patchlock._patchlock import Estimate, Tracker, _checked_config

if TYPE_CHECKING:
    from typing import TypeAlias

    import numpy as np
    import numpy.typing as npt

    from patchlock._patchlock import Config
    from patchlock._types import BoxLike

    _Box: TypeAlias = tuple[int, int, int, int] | tuple[float, float, float, float]
    _Image: TypeAlias = npt.NDArray[np.uint8] | npt.NDArray[np.uint16] | npt.NDArray[np.float32]

__all__ = ["TrackerPatchlock", "TrackerPatchlock_create"]


class TrackerPatchlock:
    """Follows one target, with the methods of `cv2.Tracker`.

    Images are numpy arrays as `cv2.imread` and `cv2.VideoCapture` return them: BGR or grey. Boxes are left,
    top, width, height in pixels, counted from 0.

    Unlike OpenCV's trackers, it supports a second `init` and boxes that are fractional or partly outside the
    image, and it raises `ValueError` or `TypeError` for invalid input instead of crashing.

    Args:
        config: A `patchlock.Config`; `None` for the preset `robust`.
        preset: The name of a preset, instead of `config`.
        min_score: `update` returns `ok` as true if the score is at least this, 0 to 1, and the target is not
            lost. With the method `paper` the score is the visible share of the target; its typical value
            differs between targets.
        exact: `False` rounds boxes to whole pixels, as OpenCV's trackers do, so that drawing functions accept
            them; `True` keeps fractions.
        threads: Number of threads; `None` means one per core. The number does not change the boxes.

    Raises:
        ValueError: `min_score` is out of range, or there is no such preset.
    """

    def __init__(
        self,
        config: Config | None = None,
        *,
        preset: str | None = None,
        min_score: float = 0.1,
        exact: bool = False,
        threads: int | None = None,
    ) -> None:
        if not 0 <= min_score <= 1:
            raise ValueError(f"min_score is {min_score}; allowed: 0 to 1")
        self._settings = _checked_config(config, preset, None, None)
        self._threads = threads
        self._tracker: Tracker | None = None
        self._min_score = min_score
        self._exact = exact

    @classmethod
    def create(cls, *args: Any, **kwargs: Any) -> TrackerPatchlock:
        """Same as the constructor; corresponds to `cv2.TrackerMIL.create()`."""
        return cls(*args, **kwargs)

    def init(self, image: _Image, boundingBox: BoxLike) -> None:
        """Starts tracking the target in this box of this image.

        If the tracker already has a target, it is forgotten.

        Args:
            image: BGR array of shape (height, width, 3), or grey array of shape (height, width).
            boundingBox: Left, top, width, height.

        Raises:
            TypeError: This is not an image, or the box does not hold numbers.
            ValueError: The box lies outside the image.
        """
        if self._tracker is None:
            self._tracker = Tracker(
                image, boundingBox, self._settings, threads=self._threads, channels="bgr"
            )
        else:
            self._tracker.restart(image, boundingBox)

    def update(self, image: _Image) -> tuple[bool, _Box]:
        """Finds the target in the next image.

        Args:
            image: As for `init`, with the same size.

        Returns:
            Whether the target was found (its status is not "lost", the score is at least `min_score` and the
            centre of the box is in the image), and the box. If it was not found, the box is the best guess;
            if it is lost, the last box that was known.

        Raises:
            RuntimeError: `init` has not been called.
        """
        estimate = self._started().update(image)
        x, y, w, h = estimate.box
        height, width = image.shape[:2]
        inside = 0 <= x + (w - 1) / 2 < width and 0 <= y + (h - 1) / 2 < height
        ok = estimate.status != "lost" and estimate.score >= self._min_score and inside
        return ok, (x, y, w, h) if self._exact else (_round(x), _round(y), _round(w), _round(h))

    def getTrackingScore(self) -> float:
        """The score of the last image, 0 to 1; some of OpenCV's trackers have the same method.

        Raises:
            RuntimeError: `init` has not been called.
        """
        return self._started().estimate.score

    @property
    def estimate(self) -> Estimate | None:
        """The estimate for the last image: corners, status, visibility; `None` before `init`."""
        return None if self._tracker is None else self._tracker.estimate

    def _started(self) -> Tracker:
        if self._tracker is None:
            raise RuntimeError("the tracker has no target yet: call init(image, box) first")
        return self._tracker


def TrackerPatchlock_create(*args: Any, **kwargs: Any) -> TrackerPatchlock:
    """Same as `TrackerPatchlock`, with the name that OpenCV would give the function."""
    return TrackerPatchlock(*args, **kwargs)


def _round(value: float) -> int:
    return math.floor(value + 0.5)
