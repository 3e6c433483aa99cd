"""`track`, which tracks through a whole video, and its estimates as a table."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, cast

from tqdm import tqdm

from patchlock._patchlock import Config, Estimate, Frames, Tracker, _checked_config

if TYPE_CHECKING:
    import pandas as pd

    from patchlock._patchlock import Network
    from patchlock._types import BoxLike, FrameLike, ModelLike


def track(
    source: str | os.PathLike[str] | int | Iterable[FrameLike],
    box: BoxLike,
    *,
    config: Config | str | None = None,
    preset: str | None = None,
    model: Network | ModelLike | None = None,
    runtime: str | os.PathLike[str] | None = None,
    start: int = 0,
    end: int | None = None,
    stride: int = 1,
    reverse: bool = False,
    threads: int | None = None,
    channels: Literal["rgb", "bgr"] = "rgb",
    max_pixels: int = 36_000_000,
    reconnect: float = 60,
    progress: bool | None = False,
) -> Iterator[Estimate]:
    """Tracks a target through a video and yields one estimate per frame.

    The boxes are identical, bit for bit, to those of the command `patchlock track`.

    Args:
        source: Anything that the command accepts (a folder of images, a pattern such as `"img/%04d.jpg"`, a
            glob, an MP4 or Y4M file, `"-"` for Y4M on standard input), or any iterable of frames: a list, a
            generator, an array whose first axis is time. A number is a camera of this machine, an address
            such as `"rtsp://host/path"` a live stream: the newest frame is tracked, and frames that come
            meanwhile are left out, which the numbers of the frames show.
        box: The target in the first tracked frame: x, y, w, h in pixels, counted from 0.
        config: A `Config`, or the name of a preset; `None` for the preset `robust`.
        preset: The name of a preset, instead of `config`.
        model: The network of the preset `network`: a `Network`, or what `Network` takes. It takes
            precedence over that of `config`.
        runtime: What runs the network, as for `Network`, if `model` is not a `Network`.
        start: Number of the first frame of the range.
        end: Number of the first frame after the range; `None` for the end of the source.
        stride: Take every `stride`-th frame.
        reverse: Go from the last frame of the range to the first; the box is then in the last frame. Needs
            the name of a source, or a sequence.
        threads: Number of threads; `None` means one per core. The number does not change the boxes.
        channels: Channel order of colour arrays: `"bgr"` for images read by OpenCV.
        max_pixels: Most pixels of a frame of a named source, width times height. A source that claims more is
            refused before memory is taken for it.
        reconnect: Seconds to wait in all, between attempts to open a live stream that was lost; with 0, the
            estimates end there. A warning tells of a loss.
        progress: Whether to show a `tqdm` progress bar; `None` shows it where standard error is a
            terminal.

    Yields:
        The estimates, starting with the frame of the box. `Estimate.frame` is the frame's number in the
        source.

    Raises:
        ValueError: The settings, the network, the range, the box or a frame is invalid.
        TypeError: A frame is neither an array nor an image.
        OSError: The source or a file of the network can't be read.
    """
    # The iterator starts later: wrong settings are found now, and a copy keeps what they are now.
    settings = _checked_config(config, preset, model, runtime)
    if isinstance(source, (str, os.PathLike, int)):
        files = Frames(
            source,
            start=start,
            end=end,
            stride=stride,
            reverse=reverse,
            max_pixels=max_pixels,
            reconnect=reconnect,
        )
        # They are decoded to RGB.
        start_on = partial(Tracker, box=box, config=settings, threads=threads)
        return _follow(start_on, files, files.count, progress)
    start_on = partial(Tracker, box=box, config=settings, threads=threads, channels=channels)
    numbered, count = _numbered(source, _range(start, end, stride), reverse)
    return _follow(start_on, numbered, count, progress)


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
    start_on: Callable[[FrameLike], Tracker],
    frames: Iterable[tuple[int, FrameLike]],
    count: int | None,
    progress: bool | None,
) -> Iterator[Estimate]:
    hidden = None if progress is None else not progress
    tracker: Tracker | None = None
    with tqdm(total=count, unit="frame", disable=hidden) as bar:
        for number, frame in frames:
            if tracker is None:
                tracker = start_on(frame)
            else:
                tracker.update(frame)
            estimate = tracker.estimate
            bar.set_postfix_str(_state(estimate), refresh=False)
            bar.update()
            yield estimate.numbered(number)
    if tracker is None:
        raise ValueError("the source has no frames in this range")


def _state(estimate: Estimate) -> str:
    """The score with the status, unless the target is simply tracked; that of a lost one says nothing."""
    if estimate.status == "lost":
        return "lost"
    status = "" if estimate.status == "tracked" else f" {estimate.status}"
    return f"score={estimate.score:.2f}{status}"


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
