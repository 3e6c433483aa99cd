"""`track`, which tracks through a whole video, and its estimates as a table."""

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
    preset: str = "robust",
    config: str | os.PathLike[str] | None = None,
    start: int = 0,
    end: int | None = None,
    stride: int = 1,
    reverse: bool = False,
    threads: int | None = None,
    channels: Literal["rgb", "bgr"] = "rgb",
    max_pixels: int = 36_000_000,
    progress: bool | None = False,
    **overrides: Unpack[Settings],
) -> Iterator[Estimate]:
    """Tracks a target through a video and yields one estimate per frame.

    The boxes are identical, bit for bit, to those of the command `patchlock track`.

    Args:
        source: Anything that the command accepts (a folder of images, a pattern such as `"img/%04d.jpg"`, a
            glob, an MP4 or Y4M file, `"-"` for Y4M on standard input), or any iterable of frames: a list, a
            generator, an array whose first axis is time.
        box: The target in the first tracked frame: x, y, w, h in pixels, counted from 0.
        preset: The preset to start from.
        config: A TOML file with settings that differ from the preset, as `patchlock config` writes it.
        start: Number of the first frame of the range.
        end: Number of the first frame after the range; `None` for the end of the source.
        stride: Take every `stride`-th frame.
        reverse: Go from the last frame of the range to the first; the box is then in the last frame. Needs
            the name of a source, or a sequence.
        threads: Number of threads; `None` means one per core. The number does not change the boxes.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV.
        max_pixels: Most pixels of a frame of a named source, width times height. A source that claims more is
            refused before memory is taken for it.
        progress: Whether to show a `tqdm` progress bar; `None` shows it where standard error is a
            terminal.
        **overrides: Settings that differ from the preset and the file, such as `seed=3`; `parameters()` lists
            all of them.

    Yields:
        The estimates, starting with the frame of the box. `Estimate.frame` is the frame's number in the
        source.

    Raises:
        ValueError: A setting, the range, the box or a frame is invalid.
        TypeError: There is no such setting, or a frame is neither an array nor an image.
        OSError: The source can't be read.
    """
    if isinstance(source, (str, os.PathLike)):
        # Frames are decoded to RGB.
        tracker = Tracker(preset, config=config, threads=threads, **overrides)
        files = Frames(
            source, start=start, end=end, stride=stride, reverse=reverse, max_pixels=max_pixels
        )
        return _follow(tracker, files, files.count, box, progress)
    tracker = Tracker(preset, config=config, threads=threads, channels=channels, **overrides)
    numbered, count = _numbered(source, _range(start, end, stride), reverse)
    return _follow(tracker, numbered, count, box, progress)


def _range(start: int, end: int | None, stride: int) -> slice:
    """Checks the range and returns it as a slice."""
    if start < 0:
        raise ValueError(f"start is {start}; frames count from 0")
    if stride < 1:
        raise ValueError(f"stride is {stride}; it must be at least 1")
    if end is not None and end <= start:
        raise ValueError(f"end={end} is not after start={start}: the range contains no frame")
    return slice(start, end, stride)


def _numbered(
    frames: Iterable[FrameLike], chosen: slice, reverse: bool
) -> tuple[Iterable[tuple[int, FrameLike]], int | None]:
    """The chosen frames with their numbers, and their count if it is known."""
    try:
        length: int | None = len(cast("Sequence[FrameLike]", frames))
    except TypeError:
        length = None
    if length is None:
        if reverse:
            raise TypeError(
                "reverse needs frames that can be indexed: a list, an array, or the name of a source"
            )
        return islice(enumerate(frames), chosen.start, chosen.stop, chosen.step), None
    indices = range(length)[chosen]
    if length <= chosen.start and length > 0:
        raise ValueError(f"start={chosen.start} is beyond the end: there are {length} frames")
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
    started = False
    with tqdm(total=count, unit="frame", disable=hidden) as bar:
        for number, frame in frames:
            estimate = tracker.update(frame) if started else tracker.init(frame, box)
            started = True
            bar.set_postfix(score=f"{estimate.score:.2f}", refresh=False)
            bar.update()
            yield estimate.numbered(number)
    if not started:
        raise ValueError("the source has no frames in this range")


def to_dataframe(estimates: Iterable[Estimate]) -> pd.DataFrame:
    """Converts estimates to a pandas table, indexed by frame.

    The columns are those of `patchlock track --save`, without the time. Needs pandas: `pip install pandas`.

    Raises:
        ImportError: pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise ImportError('to_dataframe needs pandas: pip install pandas') from error
    rows: list[dict[str, Any]] = [estimate.to_dict() for estimate in estimates]
    return pd.DataFrame(rows).set_index("frame") if rows else pd.DataFrame()
