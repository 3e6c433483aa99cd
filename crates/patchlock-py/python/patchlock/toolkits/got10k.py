"""A tracker for the experiments of the got10k toolkit: `pip install got10k`.

```python
from got10k.experiments import ExperimentOTB
from patchlock.toolkits.got10k import PatchlockTracker

experiment = ExperimentOTB("OTB", version=2013)
experiment.run(PatchlockTracker())
experiment.report(["Patchlock"])
```
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from patchlock._patchlock import Estimate, Tracker, _checked_config

if TYPE_CHECKING:
    from patchlock._patchlock import Config
    from patchlock._types import BoxLike, FrameLike

try:
    from got10k.trackers import Tracker as _Got10kTracker
except ImportError as _error:
    raise ImportError(
        f"patchlock.toolkits.got10k needs the got10k toolkit ({_error}): pip install got10k"
    ) from _error

__all__ = ["PatchlockTracker"]


class PatchlockTracker(_Got10kTracker):  # type: ignore[misc]  # got10k has no types
    """Patchlock as a `got10k.trackers.Tracker`.

    The same seed gives the same boxes, so the tracker is declared deterministic and the toolkit runs it once.
    For several seeds, make one tracker per seed, each with its own `name`.

    Args:
        config: A `patchlock.Config`; `None` for the preset `robust`.
        preset: The name of a preset, instead of `config`.
        name: Name of the results folder.
        origin: Coordinate of the first pixel in the dataset. OTB, GOT-10k and most others count from 1, and
            the toolkit passes their boxes on unchanged.
        threads: Number of threads; `None` means one per core. The number does not change the boxes.
    """

    def __init__(
        self,
        config: Config | None = None,
        *,
        preset: str | None = None,
        name: str = "Patchlock",
        origin: float = 1,
        threads: int | None = None,
    ) -> None:
        super().__init__(name=name, is_deterministic=True)
        self._settings = _checked_config(config, preset, None, None)
        self._threads = threads
        self._tracker: Tracker | None = None
        self._origin = origin

    @property
    def estimate(self) -> Estimate | None:
        """The estimate for the last image; `None` before `init`."""
        return None if self._tracker is None else self._tracker.estimate

    def init(self, image: FrameLike, box: BoxLike) -> None:
        """Starts tracking the target in this box of this image.

        Args:
            image: PIL image or array, as the toolkit passes it.
            box: Left, top (from `origin`), width, height.
        """
        x, y, w, h = (float(value) for value in box)
        shifted = (x - self._origin, y - self._origin, w, h)
        self._tracker = Tracker(image, shifted, self._settings, threads=self._threads)

    def update(self, image: FrameLike) -> npt.NDArray[np.float64]:
        """Finds the target in the next image.

        Returns:
            Left, top (from `origin`), width, height; shape (4,).
        """
        if self._tracker is None:
            raise RuntimeError("the tracker has no target yet: call init(image, box) first")
        x, y, w, h = self._tracker.update(image).box
        return np.array([x + self._origin, y + self._origin, w, h])
