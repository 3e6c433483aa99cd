"""Tracks for other tools: the command `patchlock export`, from Python."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal

from patchlock._patchlock import Estimate, _export


def export(
    track: str | os.PathLike[str] | Iterable[Estimate] | Iterable[Mapping[int, Estimate]],
    format: Literal["mot", "coco", "cvat", "yolo", "lasot", "got10k"],
    out: str | os.PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    images: str | os.PathLike[str] | None = None,
    label: str = "target",
    name: str | None = None,
    overwrite: bool = False,
) -> int:
    """Writes a track in the format of another tool. The files are complete or not there at all.

    | format | what is made | read by, for example |
    |---|---|---|
    | `"mot"` | a text file: frame, id, left, top, width, height, confidence, all counted from 1 | motmetrics, TrackEval |
    | `"coco"` | a JSON file: COCO with videos and tracks, the turned outline as segmentation | pycocotools |
    | `"cvat"` | an XML file: CVAT for video 1.1, to correct a track by hand | CVAT |
    | `"yolo"` | a folder: `data.yaml`, `labels/train`; targets lose their ids | detectors |
    | `"lasot"`, `"got10k"` | a folder for each target, as in these benchmarks | their toolkits |

    Args:
        track: Estimates of one target, as `track` and `Tracker` give them; or of many, a dictionary a frame, as `MultiTracker.update`
            gives them; or the name of a table that the command `patchlock track` has saved. `Estimate.frame` is the frame's number.
        format: The name of the format.
        out: The file or the folder to make; a folder must not be there yet, or be empty.
        size: Width and height of the frames in pixels; coco, cvat, yolo and got10k ask for them, unless `images` tells.
        images: The folder of the frames, all of them: yolo, lasot and got10k get copies of those in the track, coco their names.
        label: What the targets are.
        name: Name of the video; `None` for that of the table, or of `out`.
        overwrite: Replace a file that exists. A folder with files in it is never replaced.

    Returns:
        The number of files that were written.

    Raises:
        ValueError: Something is missing or does not fit together, or `out` is in use.
        OSError: A file can't be read or written.
    """
    if isinstance(track, (str, os.PathLike)):
        source: str | os.PathLike[str] | list[_Row] = track
        stem = Path(track).stem
    else:
        source = [_row(number, estimate) for frame in track for number, estimate in _targets(frame)]
        stem = Path(out).stem
    return _export(source, format, out, size, images, label, stem if name is None else name, overwrite)


_Row = tuple[int, int, tuple[float, float, float, float], float, list[list[float]]]


def _targets(frame: Estimate | Mapping[int, Estimate]) -> Iterable[tuple[int, Estimate]]:
    return [(1, frame)] if isinstance(frame, Estimate) else frame.items()


def _row(number: int, estimate: Estimate) -> _Row:
    return estimate.frame, number, estimate.box, estimate.score, estimate.corners.tolist()
