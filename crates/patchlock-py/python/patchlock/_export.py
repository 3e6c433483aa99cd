"""Exports tracks to the formats of other tools: the command `patchlock export`, from Python."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from patchlock._patchlock import Estimate, _export, _export_formats


def export_formats() -> dict[str, str]:
    """The formats of `export`: the name of each, and what it writes."""
    return dict(_export_formats())


def export(
    track: str | os.PathLike[str] | Iterable[Estimate] | Iterable[Mapping[int, Estimate]],
    format: str,
    out: str | os.PathLike[str],
    *,
    size: tuple[int, int] | None = None,
    images: str | os.PathLike[str] | None = None,
    label: str = "target",
    name: str | None = None,
    status: str | Sequence[str] | None = None,
    min_score: float | None = None,
    every: int = 1,
    key_frames: float = 1,
    overwrite: bool = False,
) -> int:
    """Writes a track in the format of another tool.

    Files are written completely or not at all. `export_formats()` lists the formats.

    Formats to train a detector (`"yolo"`, `"yolo-obb"`, `"voc"`, `"coco"`) get only tracked boxes, and no frame
    in which another box or a lost target is; a warning counts what is left out. The others get all boxes, and
    mark frames in which a target is lost: `"mot"` by confidence 0, `"cvat"` as outside, `"label-studio"` by the
    end of a stretch, `"lasot"` as full occlusion, `"got10k"` as absence. In `"cvat"` and `"label-studio"`,
    frames in which a target has no box are marked like those in which it is lost. Without `images`, the clip
    ends with the last frame of the track.

    Args:
        track: Estimates of one target, as `track` and `Tracker` return them; or of many targets, one
            dictionary per frame, as `MultiTracker.update` returns them; or the name of a table saved by the
            command `patchlock track`. `Estimate.frame` is the frame number.
        format: The name of the format.
        out: The file or folder to create. A folder must be empty or not exist yet.
        size: Width and height of the frames in pixels. Most formats need it, unless `images` is given or
            `track` is a table that has it.
        images: The folder of all frames that were tracked, or the video. Formats with images copy those in
            the track; coco refers to them by name; cvat and label-studio have their number.
        label: The class of the targets.
        name: Name of the video; `None` for the name of the table or of `out`.
        status: Write only boxes with this status or these: `"tracked"`, `"uncertain"`, `"lost"`. `None` for
            tracked ones in formats to train a detector, and for all in the others.
        min_score: Write only boxes with at least this score, from 0 to 1.
        every: Write only every so many-th frame: frames 0, `every`, 2 `every` and so on.
        key_frames: For cvat and label-studio, which interpolate between key frames. A whole number makes every
            so many-th box one, besides the first and the last of each run of frames with a box, and those
            where something changes. A number below 1 takes as few as are needed for interpolated boxes to
            overlap those of the track by at least this IoU.
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
    return _export(
        source,
        format,
        out,
        size,
        images,
        label,
        named,
        status,
        min_score,
        every,
        key_frames,
        overwrite,
    )


_Row = tuple[int, int, tuple[float, float, float, float], float, list[list[float]], str]


def _targets(frame: Estimate | Mapping[int, Estimate]) -> Iterable[tuple[int, Estimate]]:
    return [(1, frame)] if isinstance(frame, Estimate) else frame.items()


def _row(number: int, estimate: Estimate) -> _Row:
    corners = estimate.corners.tolist()
    return estimate.frame, number, estimate.box, estimate.score, corners, estimate.status
