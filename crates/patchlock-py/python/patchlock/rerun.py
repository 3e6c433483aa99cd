"""Shows the inside of the tracker in the rerun viewer: `pip install rerun-sdk`.

```python
import patchlock
import rerun as rr

rr.init("patchlock", spawn=True)  # or rr.save("track.rrd") after rr.init("patchlock")
tracker = patchlock.Tracker(frames[0], box)
for frame in frames[1:]:
    estimate, observation = tracker.update_observed(frame)
    patchlock.rerun.log(estimate, frame, observation)
```
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Literal

import numpy as np

from patchlock._patchlock import (
    CommitteeObservation,
    Estimate,
    NetworkObservation,
    PaperObservation,
    RobustObservation,
)

if TYPE_CHECKING:
    import numpy.typing as npt
    import rerun as rr

    from patchlock._types import FrameLike

__all__ = ["log"]

_VISIBLE = np.array([46, 211, 183], np.uint8)
_HIDDEN = np.array([255, 127, 40], np.uint8)
_BOX = (255, 255, 255)
_LOST = (150, 156, 164)


def log(
    estimate: Estimate | Mapping[int, Estimate],
    frame: FrameLike | None = None,
    observation: PaperObservation | RobustObservation | NetworkObservation | CommitteeObservation | None = None,
    *,
    entity: str = "patchlock",
    timeline: str = "frame",
    channels: Literal["rgb", "bgr"] = "rgb",
    recording: rr.RecordingStream | None = None,
) -> None:
    """Logs one tracked frame, at its frame number on the timeline.

    | entity | content |
    |---|---|
    | `<entity>/frame` | the frame, if given |
    | `<entity>/frame/box`, `/outline` | the upright box, the rotated outline; grey if the target is lost |
    | `<entity>/score`, `/visible/large`, `/visible/small` | the score and the visible shares over time |
    | `<entity>/patches/large`, `/small` | the patches: green is visible, orange is hidden |

    A `PaperObservation` adds:

    | entity | content |
    |---|---|
    | `<entity>/frame/particles` | centres of the particles; brighter is more likely |
    | `<entity>/candidate` | the candidate that became the estimate |
    | `<entity>/templates`, `/mask` | all templates side by side, the mask of the last replacement |

    A `RobustObservation` adds:

    | entity | content |
    |---|---|
    | `<entity>/certainty` | how certain the memory is of the estimate, over time |
    | `<entity>/tracking_filter`, `/memory` | their responses around the estimate, which is in the middle |

    A `NetworkObservation` adds:

    | entity | content |
    |---|---|
    | `<entity>/cells` | the scores of the cells of the search window; white is 1 |
    | `<entity>/frame/seen` | the box that the network saw, before its size was smoothed |

    A `CommitteeObservation` adds:

    | entity | content |
    |---|---|
    | `<entity>/robust`, `/network` | what the observations of the members add |
    | `<entity>/frame/filters`, `/frame/network` | the members' own boxes |

    If the method does not know which patches are visible, the entities of patches are left out. With several targets, the id is appended to every entity except the frame, as in
    `patchlock/score/2`. Without targets, nothing is logged.

    Args:
        estimate: The estimate for the frame, or one for each id, as `MultiTracker.update` returns them.
        frame: The frame that was passed to the tracker.
        observation: The observation returned by `Tracker.update_observed`; only for a single target.
        entity: Path in the recording under which everything is logged.
        timeline: Name of the timeline of frame numbers.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV.
        recording: The recording; `None` for the active one.

    Raises:
        ImportError: The rerun SDK is not installed.
        TypeError: An observation was given with several targets.
        ValueError: The estimates belong to different frames.
    """
    if isinstance(estimate, Mapping) and observation is not None:
        raise TypeError("an observation belongs to one target; log it with that target's estimate")
    targets = {f"/{i}": e for i, e in estimate.items()} if isinstance(estimate, Mapping) else {"": estimate}
    numbers = {one.frame for one in targets.values()}
    if len(numbers) > 1:
        raise ValueError(f"the estimates belong to different frames: {sorted(numbers)}")
    try:
        import rerun as rr
    except ImportError as error:
        raise ImportError('patchlock.rerun needs the rerun SDK: pip install rerun-sdk') from error
    for number in numbers:
        rr.set_time(timeline, sequence=number, recording=recording)
        if frame is not None:
            rr.log(f"{entity}/frame", rr.Image(_pixels(frame, channels)), recording=recording)
        for name, one in targets.items():
            for path, item in _of_estimate(one, name):
                rr.log(f"{entity}/{path}{name}", item, recording=recording)
        for path, item in _of_observation(observation) if observation else ():
            rr.log(f"{entity}/{path}", item, recording=recording)


def _pixels(frame: FrameLike, channels: str) -> npt.NDArray[np.generic]:
    # Only arrays can be BGR: PIL images carry their own channel order.
    swapped = channels == "bgr" and isinstance(frame, np.ndarray) and frame.ndim == 3
    pixels = np.asarray(frame)
    return pixels[..., ::-1] if swapped else pixels


def _of_estimate(estimate: Estimate, name: str) -> Iterator[tuple[str, rr.AsComponents]]:
    import rerun as rr

    x, y, w, h = estimate.box
    status = "" if estimate.status == "tracked" else estimate.status
    label = f"{name[1:]} {estimate.score:.2f} {status}".strip()
    outline_colour = {"tracked": tuple(_VISIBLE), "uncertain": tuple(_HIDDEN), "lost": _LOST}[estimate.status]
    box_colour = _LOST if estimate.status == "lost" else _BOX
    yield "frame/box", rr.Boxes2D(mins=[[x, y]], sizes=[[w, h]], labels=[label], colors=[box_colour])
    # In the viewer pixel k spans k to k + 1, so its centre is at k + 0.5.
    outline = estimate.corners[[0, 1, 2, 3, 0]] + 0.5
    yield "frame/outline", rr.LineStrips2D([outline], colors=[outline_colour])
    yield "score", rr.Scalars(estimate.score)
    if estimate.visibility is None:
        return
    for scale, visible in zip(("large", "small"), estimate.visibility, strict=True):
        yield f"visible/{scale}", rr.Scalars(float(visible.mean()))
        yield f"patches/{scale}", rr.Image(np.where(visible[..., None], _VISIBLE, _HIDDEN).astype(np.uint8))


def _of_observation(
    seen: PaperObservation | RobustObservation | NetworkObservation | CommitteeObservation,
) -> Iterator[tuple[str, rr.AsComponents]]:
    import rerun as rr

    if isinstance(seen, CommitteeObservation):
        for name, member in seen.observations.items():
            for entity, content in _of_observation(member):
                yield entity if entity.startswith("frame/") else f"{name}/{entity}", content
        for name, estimate in seen.estimates.items():
            x, y, w, h = estimate.box
            yield f"frame/{name}", rr.Boxes2D(mins=[[x, y]], sizes=[[w, h]], colors=[_LOST])
        return

    if isinstance(seen, RobustObservation):
        yield "certainty", rr.Scalars(seen.certainty)
        yield "tracking_filter", rr.Image(_grey(np.fft.fftshift(seen.tracking_filter)))
        yield "memory", rr.Image(_grey(np.fft.fftshift(seen.memory)))
        return
    if isinstance(seen, NetworkObservation):
        yield "cells", rr.Image((255 * seen.scores).astype(np.uint8))
        x, y, w, h = seen.seen
        yield "frame/seen", rr.Boxes2D(mins=[[x, y]], sizes=[[w, h]], colors=[_VISIBLE])
        return
    if isinstance(seen, PaperObservation):
        yield (
            "frame/particles",
            rr.Points2D(seen.particles[:, :2] + 0.5, colors=_brightness(seen.likelihoods), radii=1.0),
        )
        yield "candidate", rr.Image(_grey(seen.candidate))
        yield "templates", rr.Image(_grey(np.hstack(list(seen.templates))))
        if seen.mask is not None:
            yield "mask", rr.Image((255 * seen.mask).astype(np.uint8))


def _brightness(likelihoods: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
    """From dark to bright with the likelihood; black where it is not finite."""
    finite = np.isfinite(likelihoods)
    share = np.zeros(len(likelihoods))
    if finite.any():
        low, high = likelihoods[finite].min(), likelihoods[finite].max()
        share[finite] = (likelihoods[finite] - low) / max(high - low, 1e-12)
    bright, dark = share[:, None] * np.array([255, 230, 90]), (finite * (1 - share))[:, None] * 60
    colours: npt.NDArray[np.float64] = bright + dark
    return colours.astype(np.uint8)


def _grey(samples: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Stretched to the full range: templates have unit norm and would look dark, and so have responses."""
    low, high = float(samples.min()), float(samples.max())
    return ((samples - low) / max(high - low, 1e-12) * 255).astype(np.uint8)
