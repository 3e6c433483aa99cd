"""A tracker for the experiments of the got10k toolkit: `pip install patchlock[got10k]`.

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

from patchlock._patchlock import Estimate, Tracker

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from patchlock._settings import Settings
    from patchlock._types import BoxLike, FrameLike

try:
    from got10k.trackers import Tracker as _Got10kTracker
except ImportError as _error:
    raise ImportError(
        f"patchlock.toolkits.got10k needs the got10k toolkit ({_error}): pip install 'patchlock[got10k]'"
    ) from _error

__all__ = ["PatchlockTracker"]


class PatchlockTracker(_Got10kTracker):  # type: ignore[misc]  # got10k has no types
    """Patchlock as a `got10k.trackers.Tracker`.

    The same seed gives the same boxes, so the toolkit is told that the tracker is deterministic and runs it once. For several seeds give each
    its own `name` and `seed`.

    Args:
        preset: The set of settings to begin with.
        name: The folder of the results.
        origin: What the dataset calls the first pixel. OTB, GOT-10k and most others count from 1, and the toolkit hands their boxes on as they are.
        threads: Number of threads; `None` for one for each core. The boxes are the same for any number.
        **overrides: Settings that differ from the preset, such as `seed=1`; `patchlock.parameters()` lists all.
    """

    def __init__(
        self,
        preset: str = "paper",
        *,
        name: str = "Patchlock",
        origin: float = 1,
        threads: int | None = None,
        **overrides: Unpack[Settings],
    ) -> None:
        super().__init__(name=name, is_deterministic=True)
        self._tracker = Tracker(preset, threads=threads, **overrides)
        self._origin = origin
        self.estimate: Estimate | None = None
        """All that is known of the last image; `None` before `init`."""

    def init(self, image: FrameLike, box: BoxLike) -> None:
        """Begins on the target in a box of an image.

        Args:
            image: PIL image or array, as the toolkit gives it.
            box: Left, top (from `origin`), width, height.
        """
        x, y, w, h = (float(value) for value in box)
        self.estimate = self._tracker.init(image, (x - self._origin, y - self._origin, w, h))

    def update(self, image: FrameLike) -> npt.NDArray[np.float64]:
        """Finds the target in the next image.

        Returns:
            Left, top (from `origin`), width, height; shape (4,).
        """
        self.estimate = self._tracker.update(image)
        x, y, w, h = self.estimate.box
        return np.array([x + self._origin, y + self._origin, w, h])
