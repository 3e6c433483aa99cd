"""`track`, which tracks through a whole video, and its estimates as a table."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from itertools import islice
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar, cast, overload

from tqdm import tqdm

from patchlock._patchlock import Config, Estimate, Frames, MultiTracker, Tracker, VideoWriter, _checked_config
from patchlock._types import Box

if TYPE_CHECKING:
    import pandas as pd

    from patchlock._patchlock import Network
    from patchlock._types import BoxLike, FrameLike, ModelLike

_Source: TypeAlias = "str | os.PathLike[str] | int | Iterable[FrameLike]"
_Boxes: TypeAlias = "Mapping[int, BoxLike] | Iterable[BoxLike]"
_Found = TypeVar("_Found", Estimate, dict[int, Estimate])
# Starts on the first frame: its estimates, and what finds those of the next ones.
_Begin: TypeAlias = "Callable[[FrameLike], tuple[_Found, Callable[[FrameLike], _Found]]]"

RATE = 30.0
"""Frames per second of a video whose frames have no times."""


@overload
def track(
    source: _Source,
    box: BoxLike,
    *,
    boxes: None = None,
    config: Config | None = None,
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
    video: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool | None = False,
    **settings: float | str | bool,
) -> Iterator[Estimate]: ...


@overload
def track(
    source: _Source,
    box: None = None,
    *,
    boxes: _Boxes,
    config: Config | None = None,
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
    video: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool | None = False,
    **settings: float | str | bool,
) -> Iterator[dict[int, Estimate]]: ...


def track(
    source: _Source,
    box: BoxLike | None = None,
    *,
    boxes: _Boxes | None = None,
    config: Config | None = None,
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
    video: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    progress: bool | None = False,
    **settings: float | str | bool,
) -> Iterator[Estimate] | Iterator[dict[int, Estimate]]:
    """Tracks one target or many through a video, in one pass, and yields the estimates of each frame.

    The boxes are identical, bit for bit, to those of the command `patchlock track`.

    ```python
    for estimate in patchlock.track("video.mp4", box=(46, 58, 48, 40), search=7):
        print(estimate.frame, estimate.box, estimate.status)
    for found in patchlock.track("video.mp4", boxes=[(46, 58, 48, 40), (40, 30, 36, 30)], video="out.mp4"):
        print(found[1].box, found[2].box)
    ```

    Args:
        source: Anything that the command accepts (a folder of images, a pattern such as `"img/%04d.jpg"`, a
            glob, an MP4 or Y4M file, `"-"` for Y4M on standard input), or any iterable of frames: a list, a
            generator, an array whose first axis is time. A number is a camera of this machine, an address
            such as `"rtsp://host/path"` a live stream: the newest frame is tracked, and frames that come
            meanwhile are left out, which the numbers of the frames show.
        box: The target in the first tracked frame: x, y, w, h in pixels, counted from 0.
        boxes: Many targets in the first tracked frame, instead of `box`: a dictionary of boxes by id, a whole
            number; or boxes, such as a list or an array, with the ids 1, 2 and so on.
        config: A `Config`; `None` for the preset `robust`.
        preset: The name of a preset, instead of `config`.
        model: The network: alone with the preset `network`, beside the default tracker with `robust`. A
            `Network`, what `Network` takes, or `"none"`. By default that of `config`, or else `"patchnet"`.
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
        video: Also draw the track into this MP4 file, as `VideoWriter` does. It is complete after the last
            estimate, or up to the frame at which the iteration is given up.
        overwrite: Replace an existing `video`.
        progress: Whether to show a `tqdm` progress bar; `None` shows it where standard error is a
            terminal.
        settings: Settings to change, by name, such as `search=7`; `parameters()` describes them.

    Yields:
        An estimate, or with `boxes` a dictionary with one for each id, starting with the frame of the boxes.
        `Estimate.frame` is the frame's number in the source.

    Raises:
        ValueError: The settings, the network, the range, a box or a frame is invalid, or `video` exists.
        TypeError: A frame is neither an array nor an image, or a keyword argument is not a setting.
        OSError: The source or a file of the network can't be read, or `video` can't be written.
    """
    # The iterator starts later: wrong settings are found now, and a copy keeps what they are now.
    arguments = list(cast("dict[str, object]", track.__kwdefaults__))
    checked = _checked_config(config, preset, model, runtime, settings, arguments)
    options: dict[str, Any] = {"config": checked, "threads": threads, "channels": channels}
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
        frames: Iterable[tuple[int, FrameLike]] = files
        count, rate = files.count, files.rate
        # They are decoded to RGB.
        options["channels"] = "rgb"
    else:
        frames, count = _numbered(source, _range(start, end, stride), reverse)
        rate = None
    if (box is None) == (boxes is None):
        raise TypeError("track takes either box, of one target, or boxes, of many")
    many = None if boxes is None else _by_id(boxes)
    writer = None
    if video is not None:
        _check_video(video, source)
        rate = (RATE if rate is None else rate) / stride
        writer = VideoWriter(
            video, rate=rate, count=count, channels=options["channels"], overwrite=overwrite
        )
    if many is not None:
        return _follow(_many(many, options), frames, count, progress, writer)
    return _follow(_one(box, options), frames, count, progress, writer)


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


def _by_id(boxes: _Boxes) -> dict[int, BoxLike]:
    """The boxes by id; those without ids count from 1."""
    if isinstance(boxes, Mapping):
        for number in boxes:
            if isinstance(number, bool) or not isinstance(number, Integral) or number < 0:
                raise TypeError(f"boxes has the id {number!r}; an id is a whole number, 0 or more")
        targets = {int(number): box for number, box in boxes.items()}
    else:
        targets = dict(enumerate(boxes, 1))
    if not targets:
        raise ValueError("boxes is empty; give a box for each target")
    return {number: Box.from_xywh(box) for number, box in targets.items()}


def _check_video(video: str | os.PathLike[str], source: object) -> None:
    """Refuses a video that would replace the source."""
    if isinstance(source, (str, os.PathLike)) and os.path.exists(source) and os.path.exists(video):
        if os.path.samefile(source, video):
            raise ValueError(f"video is {os.fspath(video)}, the source, and would replace it")


def _one(box: Any, options: dict[str, Any]) -> _Begin[Estimate]:
    def begin(frame: FrameLike) -> tuple[Estimate, Callable[[FrameLike], Estimate]]:
        tracker = Tracker(frame, box, **options)
        return tracker.estimate, tracker.update

    return begin


def _many(boxes: dict[int, BoxLike], options: dict[str, Any]) -> _Begin[dict[int, Estimate]]:
    def begin(
        frame: FrameLike,
    ) -> tuple[dict[int, Estimate], Callable[[FrameLike], dict[int, Estimate]]]:
        tracker = MultiTracker(**options)
        first = {number: tracker.add(frame, box)[1] for number, box in boxes.items()}
        # In the order in which they were added.
        return first, lambda frame: dict(zip(boxes, tracker.update(frame).values(), strict=True))

    return begin


def _follow(
    begin: _Begin[_Found],
    frames: Iterable[tuple[int, FrameLike]],
    count: int | None,
    progress: bool | None,
    writer: VideoWriter | None,
) -> Iterator[_Found]:
    hidden = None if progress is None else not progress
    update: Callable[[FrameLike], _Found] | None = None
    with tqdm(total=count, unit="frame", disable=hidden) as bar, writer or nullcontext():
        for number, frame in frames:
            if update is None:
                found, update = begin(frame)
            else:
                found = update(frame)
            found = _at(number, found)
            if writer is not None:
                writer.write(frame, found, time=getattr(frames, "time", None))
            bar.set_postfix_str(_state(found), refresh=False)
            bar.update()
            yield found
    if update is None:
        raise ValueError("the source has no frames in this range")


def _at(number: int, found: _Found) -> _Found:
    """The estimates with the number of the frame."""
    if isinstance(found, Estimate):
        return found.numbered(number)
    return {target: estimate.numbered(number) for target, estimate in found.items()}


def _state(found: Estimate | dict[int, Estimate]) -> str:
    """The score with the status, unless the target is simply tracked; that of a lost one says nothing."""
    if isinstance(found, dict):
        lost = sum(estimate.status == "lost" for estimate in found.values())
        return f"{len(found)} targets" + (f", {lost} lost" if lost else "")
    if found.status == "lost":
        return "lost"
    status = "" if found.status == "tracked" else f" {found.status}"
    return f"score={found.score:.2f}{status}"


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
