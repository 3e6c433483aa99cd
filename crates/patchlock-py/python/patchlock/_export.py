"""Exports tracks to the formats of other tools: the command `patchlock export`, from Python."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal

from patchlock._patchlock import Estimate, _export


def export(
    track: str | os.PathLike[str] | Iterable[Estimate] | Iterable[Mapping[int, Estimate]],
    format: Literal["mot", "coco", "cvat", "cvat-obb", "yolo", "yolo-obb", "voc", "label-studio", "lasot", "got10k"],
    out: str | os.PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    images: str | os.PathLike[str] | None = None,
    label: str = "target",
    name: str | None = None,
    key_frames: int = 1,
    overwrite: bool = False,
) -> int:
    """Writes a track in the format of another tool.

    Files are written completely or not at all.

    | format | output | read by, for example |
    |---|---|---|
    | `"mot"` | a text file: frame, id, left, top, width, height, confidence | motmetrics, TrackEval |
    | `"coco"` | a JSON file: COCO with videos, tracks and rotated outlines | pycocotools |
    | `"cvat"` | an XML file: CVAT for video 1.1, to correct a track by hand | CVAT |
    | `"cvat-obb"` | the same with the rotated outline: the box and its rotation | CVAT |
    | `"yolo"` | a folder: `data.yaml`, `labels/train`; target ids are lost | detectors |
    | `"yolo-obb"` | the same with the corners of the rotated outline | detectors |
    | `"voc"` | a folder: Pascal VOC, `Annotations` and `JPEGImages`; target ids are lost | detectors |
    | `"label-studio"` | a JSON file: a task with a prediction | Label Studio |
    | `"lasot"`, `"got10k"` | one folder per target, as in these benchmarks | their toolkits |

    Frames and positions in `"mot"` count from 1. The outlines in `"coco"` are the segmentation.

    Frames in which a target is lost are marked: in `"mot"` by confidence 0, in `"coco"` by the attribute
    `status`, in `"cvat"` as outside, in `"label-studio"` by the end of a stretch, in `"lasot"` as full
    occlusion, in `"got10k"` as absence. `"yolo"`, `"yolo-obb"` and `"voc"` have no such mark, so these frames are
    left out. In `"cvat"` and `"label-studio"`, frames in which a target has no box are marked like those in which
    it is lost. Without `images`, the clip ends with the last frame of the track.

    Args:
        track: Estimates of one target, as `track` and `Tracker` return them; or of many targets, one
            dictionary per frame, as `MultiTracker.update` returns them; or the name of a table saved by the
            command `patchlock track`. `Estimate.frame` is the frame number.
        format: The name of the format.
        out: The file or folder to create. A folder must be empty or not exist yet.
        size: Width and height of the frames in pixels. All formats but mot and lasot need it, unless `images`
            is given or `track` is a table that has it.
        images: The folder of all frames that were tracked, or the video. yolo, voc, lasot and got10k copy
            those in the track; coco refers to them by name; cvat and label-studio have their number.
        label: The class of the targets.
        name: Name of the video; `None` for the name of the table or of `out`.
        key_frames: Make only every so many-th box a key frame, besides the first and the last of each run of
            frames with a box, and those where something changes; for cvat and label-studio, which interpolate
            between them.
        overwrite: Replace an existing file. A folder that is not empty is never replaced.

    Returns:
        The number of files written.

    Raises:
        ValueError: An argument is missing or inconsistent with others, or `out` exists.
        OSError: A file can't be read or written.
    """
    if isinstance(track, (str, os.PathLike)):
        source: str | os.PathLike[str] | list[_Row] = track
        stem = Path(track).stem
    else:
        source = [_row(number, estimate) for frame in track for number, estimate in _targets(frame)]
        stem = Path(out).stem
    named = stem if name is None else name
    return _export(source, format, out, size, images, label, named, key_frames, overwrite)


_Row = tuple[int, int, tuple[float, float, float, float], float, list[list[float]], str]


def _targets(frame: Estimate | Mapping[int, Estimate]) -> Iterable[tuple[int, Estimate]]:
    return [(1, frame)] if isinstance(frame, Estimate) else frame.items()


def _row(number: int, estimate: Estimate) -> _Row:
    corners = estimate.corners.tolist()
    return estimate.frame, number, estimate.box, estimate.score, corners, estimate.status
