"""Estimates as detections of the package supervision."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from patchlock._patchlock import Estimate

if TYPE_CHECKING:
    import supervision as sv


def to_supervision(estimates: Estimate | Mapping[int, Estimate]) -> sv.Detections:
    """Converts the estimates of one frame to `supervision.Detections`.

    The detections have `xyxy`, `confidence` (the score), `class_id` 0 and `tracker_id`, and in `data` the `status` and the
    rotated outline under `xyxyxyxy`, which `supervision.OrientedBoxAnnotator` draws. Lost targets are left
    out, as their boxes are the last ones that were known. Needs supervision:
    `pip install "patchlock[supervision]"`.

    Args:
        estimates: One estimate for each id, as `MultiTracker.update` returns them; or a single estimate,
            which gets the id 1.

    Raises:
        ImportError: supervision is not installed.
    """
    try:
        import supervision as sv
    except ImportError as error:
        raise ImportError(
            'to_supervision needs supervision: pip install "patchlock[supervision]"'
        ) from error
    targets = {1: estimates} if isinstance(estimates, Estimate) else estimates
    seen = {id: estimate for id, estimate in targets.items() if estimate.status != "lost"}
    if not seen:
        return sv.Detections.empty()
    found = list(seen.values())
    return sv.Detections(
        xyxy=np.array([estimate.box.xyxy for estimate in found]),
        confidence=np.array([estimate.score for estimate in found]),
        # Annotators choose colours by class unless they are told otherwise.
        class_id=np.zeros(len(found), int),
        tracker_id=np.array(list(seen)),
        data={
            "status": np.array([estimate.status for estimate in found]),
            "xyxyxyxy": np.array([estimate.corners for estimate in found]),
        },
    )
