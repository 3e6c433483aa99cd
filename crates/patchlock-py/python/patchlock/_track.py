"""A whole video at once: `track`, and its estimates as a table."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, cast

from tqdm import tqdm

from patchlock._patchlock import Estimate, Frames, Tracker

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Unpack

    from patchlock._settings import Settings
    from patchlock._types import BoxLike, FrameLike


def track(
    source: str | os.PathLike[str] | Iterable[FrameLike],
    box: BoxLike,
    *,
    preset: str = "paper",
    start: int = 0,
    end: int | None = None,
    stride: int = 1,
    reverse: bool = False,
    threads: int | None = None,
    channels: Literal["rgb", "bgr"] = "rgb",
    progress: bool | None = None,
    **overrides: Unpack[Settings],
) -> Iterator[Estimate]:
    """Tracks the target in a box through a video, and yields an estimate a frame.

    The boxes are those of the command `patchlock track`, bit for bit.

    Args:
        source: What the command takes (a folder of images, a pattern such as `"img/%04d.jpg"`, a glob, an MP4 or Y4M file, `"-"` for
            Y4M on standard input), or anything that gives frames one by one: a list, a generator, an array whose first axis is time.
        box: The target in the first tracked frame: x, y, w, h in pixels, counted from 0.
        preset: The settings to begin with.
        start: Number of the first frame of the range.
        end: Number of the first frame after the range; `None` for all frames.
        stride: Take every so many frames.
        reverse: From the last frame of the range to the first; the box is then in the last. Needs a named source or a sequence.
        threads: Threads to use; `None` for one for each core. The boxes are the same for any number.
        channels: The order of colours in arrays: `"bgr"` for what OpenCV reads.
        progress: A bar of `tqdm`; `None` shows it on a terminal only.
        **overrides: Settings that differ from the preset, such as `seed=3`; `parameters()` lists all.

    Yields:
        The estimates, first that of the frame with the box. `Estimate.frame` is the frame's number in the source.

    Raises:
        ValueError: A setting, the box or a frame is not as it must be.
        TypeError: There is no such setting, or a frame is neither an array nor an image.
        OSError: The source can't be read.
    """
    if isinstance(source, (str, os.PathLike)):
        # What is decoded here is RGB.
        tracker = Tracker(preset, threads=threads, **overrides)
        files = Frames(source, start=start, end=end, stride=stride, reverse=reverse)
        return _follow(tracker, files, files.count, box, progress)
    tracker = Tracker(preset, threads=threads, channels=channels, **overrides)
    numbered, count = _numbered(source, _range(start, end, stride), reverse)
    return _follow(tracker, numbered, count, box, progress)


def _range(start: int, end: int | None, stride: int) -> slice:
    """The range as a slice, where it makes sense."""
    if start < 0:
        raise ValueError(f"start is {start}; frames count from 0")
    if stride < 1:
        raise ValueError(f"stride is {stride}; it must be at least 1")
    if end is not None and end <= start:
        raise ValueError(f"end is {end}, which is not after start {start}: no frame is left to track")
    return slice(start, end, stride)


def _numbered(
    frames: Iterable[FrameLike], chosen: slice, reverse: bool
) -> tuple[Iterable[tuple[int, FrameLike]], int | None]:
    """The chosen frames with their numbers, and how many there are, where that is known."""
    try:
        length: int | None = len(cast("Sequence[FrameLike]", frames))
    except TypeError:
        length = None
    if length is None:
        if reverse:
            raise TypeError("reverse needs frames that can be asked for by number: a list, an array, or the name of a source")
        return islice(enumerate(frames), chosen.start, chosen.stop, chosen.step), None
    indices = range(length)[chosen]
    if length <= chosen.start and length > 0:
        raise ValueError(f"start is {chosen.start}, but there are {length} frames")
    sequence = cast("Sequence[FrameLike]", frames)
    return ((i, sequence[i]) for i in (reversed(indices) if reverse else indices)), len(indices)


def _follow(
    tracker: Tracker,
    frames: Iterable[tuple[int, FrameLike]],
    count: int | None,
    box: BoxLike,
    progress: bool | None,
) -> Iterator[Estimate]:
    hidden = None if progress is None else not progress
    begun = False
    with tqdm(total=count, unit="frame", disable=hidden) as bar:
        for number, frame in frames:
            estimate = tracker.update(frame) if begun else tracker.init(frame, box)
            begun = True
            bar.set_postfix(score=f"{estimate.score:.2f}", refresh=False)
            bar.update()
            yield estimate.numbered(number)
    if not begun:
        raise ValueError("the source has no frames in this range")


def to_dataframe(estimates: Iterable[Estimate]) -> pd.DataFrame:
    """Estimates as a table of pandas, with the columns that `patchlock track --save` writes, indexed by frame.

    Needs pandas: `pip install "patchlock[pandas]"`.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise ImportError('to_dataframe needs pandas: pip install "patchlock[pandas]"') from error
    rows: list[dict[str, Any]] = [estimate.to_dict() for estimate in estimates]
    return pd.DataFrame(rows).set_index("frame") if rows else pd.DataFrame()
