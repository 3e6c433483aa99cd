"""Manifests: lists of clips, as a CSV or JSON Lines file with one clip per line, or as `Clip`s."""

from __future__ import annotations

import csv
import json
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from patchlock import _patchlock

COLUMNS = ("source", "box", "x", "y", "w", "h", "truth", "name", "start", "end", "stride", "seed", "settings")
"""The columns of a CSV manifest, and the fields of each object in a JSON Lines manifest."""


class ManifestError(ValueError):
    """The manifest as a whole is invalid."""


class ClipError(ValueError):
    """The description of a clip is invalid."""


@dataclass(frozen=True)
class Clip:
    """A clip, and the target in its first frame."""

    source: str | os.PathLike[str]
    """A source that `patchlock track` accepts: a folder, a pattern, a glob or a video file."""
    box: tuple[float, float, float, float] | None = None
    """x, y, w, h in pixels, counted from 0, in the first tracked frame; `None` to take it from `truth`."""
    truth: str | os.PathLike[str] | None = None
    """A text file with one box per line, for every frame of the source, counted from 1, as in OTB."""
    name: str = ""
    """Name of the results; by default the last part of the source without its extension."""
    start: int = 0
    """Number of the first frame, counted from 0."""
    end: int | None = None
    """Number of the first frame after the clip; `None` for the end of the source."""
    stride: int = 1
    """Take every `stride`-th frame."""
    seed: int | None = None
    """Seed of the random numbers; `None` for the seed in the settings."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings that differ from the common ones."""
    folder: Path = Path()
    """Base of relative paths: the folder of the manifest, or the working directory."""

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", Path(self.source).stem)

    @property
    def path(self) -> str:
        """Absolute path of the source."""
        return os.path.abspath(self.folder / self.source)

    def first_box(self) -> tuple[float, float, float, float]:
        """The first box, from `box` or from `truth`.

        Raises:
            ClipError: There is no box, or it is invalid.
        """
        box = self.box
        if box is None and self.truth is not None:
            boxes = self.read_truth()
            box = boxes[0] if boxes else None
            if box is None:
                raise ClipError(f"{self.truth} has no box for frame {self.start}, where the clip starts")
        if box is None:
            raise ClipError("there is neither a box nor a truth file")
        if len(box) != 4 or not all(map(math.isfinite, box)):
            raise ClipError(f"the box {_list(box)} is not four finite numbers x, y, w, h")
        if box[2] < 1 or box[3] < 1:
            raise ClipError(f"the box {_list(box)} is too small: width and height must be at least 1 pixel")
        return box

    def read_truth(self) -> list[tuple[float, float, float, float] | None]:
        """The true boxes of the clip's frames, counted from 0; `None` for a frame without a box."""
        if self.truth is None:
            return []
        return _patchlock.read_truth(self.folder / self.truth)[self.start : self.end : self.stride]

    def check(self) -> None:
        """Checks all that can be checked without opening the source.

        Raises:
            ClipError: A field is invalid.
        """
        if str(self.source) == "-":
            raise ClipError("the source is standard input, which worker processes can't read")
        if not is_folder_name(self.name):
            raise ClipError(
                f"name is {self.name!r}, which is not a valid name of a folder of results: it must not "
                "contain /, \\ or control characters, start with a dot, or be longer than 200 bytes"
            )
        if self.start < 0 or self.stride < 1 or (self.end is not None and self.end <= self.start):
            raise ClipError(f"start={self.start}, end={self.end} and stride={self.stride} select no frame")
        if self.seed is not None and self.seed < 0:
            raise ClipError(f"seed is {self.seed}; it must be 0 or more")


def is_folder_name(name: str) -> bool:
    """Whether a name can be that of a folder of results everywhere."""
    odd = re.search(r"[/\\\x00-\x1f\x7f-\x9f]", name) is not None
    return 0 < len(name.encode(errors="replace")) <= 200 and not odd and not name.startswith(".")


@dataclass(frozen=True)
class InvalidRow:
    """A line of a manifest that is not a valid clip."""

    name: str
    message: str


Row: TypeAlias = Clip | InvalidRow


def read(manifest: str | os.PathLike[str] | Iterable[Clip]) -> list[Row]:
    """Reads the clips of a manifest. An invalid line becomes an `InvalidRow`.

    Raises:
        ManifestError: The manifest as a whole is invalid.
    """
    rows: list[Row]
    if isinstance(manifest, (str, os.PathLike)):
        path = Path(manifest)
        readers = {".csv": _lines_of_csv, ".jsonl": _lines_of_json, ".ndjson": _lines_of_json}
        reader = readers.get(path.suffix.lower())
        if reader is None:
            raise ManifestError(f"{path}: unknown extension; use {', '.join(readers)}")
        if path.exists() and not path.is_file():
            raise ManifestError(f"{path} is a folder, a pipe or a device; a manifest is a file")
        rows = [_row(number, fields, path) for number, fields in reader(path)]
    else:
        rows = list(manifest)
    if not rows:
        raise ManifestError("the manifest has no clips")
    _refuse_duplicates(rows)
    return rows


def write_truth(manifest: str | os.PathLike[str] | Iterable[Clip], folder: str | os.PathLike[str]) -> int:
    """Collects the truth of the clips in a folder, for `patchlock score --truth`.

    Writes `<folder>/<name>.txt` for each clip that has truth, with one line per tracked frame. Without any,
    the folder is not created.

    Returns:
        The number of files.

    Raises:
        ManifestError: The manifest as a whole is invalid.
        ClipError: A clip is invalid.
        OSError: A file can't be read or written.
    """
    target = Path(folder)
    clips = {row.name: row for row in read(manifest) if isinstance(row, Clip) and row.truth is not None}
    if clips:
        target.mkdir(parents=True, exist_ok=True)
    for clip in clips.values():
        clip.check()
        lines = (
            "NaN,NaN,NaN,NaN" if box is None else _list((box[0] + 1, box[1] + 1, *box[2:]))
            for box in clip.read_truth()
        )
        (target / f"{clip.name}.txt").write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    return len(clips)


def _lines_of_csv(path: Path) -> Iterator[tuple[int, Mapping[str, Any]]]:
    with path.open(encoding="utf-8-sig", newline="") as file:
        reader = csv.DictReader(file, skipinitialspace=True)
        _check_columns(path, 1, [name or "" for name in reader.fieldnames or []])
        for fields in reader:
            cells = {name: (cell or "").strip() for name, cell in fields.items() if name is not None}
            if None in fields:
                cells["source"] = ""  # more cells than columns: the line is ambiguous
            yield reader.line_num, {name: cell for name, cell in cells.items() if cell}


def _lines_of_json(path: Path) -> Iterator[tuple[int, Mapping[str, Any]]]:
    for number, line in enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1):
        if not line.strip():
            continue
        try:
            fields = json.loads(line)
        except json.JSONDecodeError as error:
            raise ManifestError(f"{path}, line {number}, is not JSON: {error}") from error
        if not isinstance(fields, dict):
            raise ManifestError(
                f"{path}, line {number}: a clip must be an object, "
                'such as {"source": "a.mp4", "box": [1, 2, 3, 4]}'
            )
        _check_columns(path, number, list(fields))
        yield number, {name: value for name, value in fields.items() if value is not None}


def _check_columns(path: Path, line: int, names: list[str]) -> None:
    unknown = [name for name in names if name not in COLUMNS]
    if unknown:
        raise ManifestError(
            f"{path}, line {line}: there is no column {unknown[0]!r}; the columns are {', '.join(COLUMNS)}"
        )
    if "source" not in names:
        raise ManifestError(f"{path}, line {line}: the column source is missing")


def _row(number: int, fields: Mapping[str, Any], path: Path) -> Row:
    name = str(fields.get("name") or Path(str(fields.get("source", ""))).stem or f"line {number}")
    try:
        return _clip(fields, path.parent)
    except (ValueError, TypeError) as error:
        return InvalidRow(name, f"{path}, line {number}: {error}")


def _clip(fields: Mapping[str, Any], folder: Path) -> Clip:
    if not fields.get("source"):
        raise ClipError("the line has no source, or more cells than there are columns")
    numbers = {
        name: _whole(name, fields[name]) for name in ("start", "end", "stride", "seed") if name in fields
    }
    return Clip(
        source=str(fields["source"]),
        box=_box(fields),
        truth=fields.get("truth"),
        name=str(fields.get("name", "")),
        settings=_settings(fields.get("settings", {})),
        folder=folder,
        **numbers,
    )


def _box(fields: Mapping[str, Any]) -> tuple[float, float, float, float] | None:
    sides = [fields.get(name) for name in "xywh"]
    box = fields.get("box")
    if box is None and sides == [None] * 4:
        return None
    words: Any = (
        re.split(r"[\s,;]+", box.strip()) if isinstance(box, str) else box if box is not None else sides
    )
    try:
        x, y, w, h = (float(word) for word in words)
    except (TypeError, ValueError):
        raise ClipError(
            f"the box {_list(words) if isinstance(words, list) else words!r} is not four numbers x, y, w, h"
        ) from None
    return x, y, w, h


def _whole(name: str, value: Any) -> int:
    try:
        number = float(value)
        whole = int(value) if isinstance(value, str) else int(number)
    except (TypeError, ValueError):
        raise ClipError(f"{name} is {value!r}, which is not a whole number") from None
    if whole != number or isinstance(value, bool):
        raise ClipError(f"{name} is {value!r}, which is not a whole number")
    return whole


def _settings(value: Any) -> Mapping[str, Any]:
    """From an object, or from text such as `particles=60; small_step=4`."""
    if isinstance(value, dict):
        return value
    settings = {}
    for part in filter(None, (part.strip() for part in str(value).split(";"))):
        name, sign, word = (piece.strip() for piece in part.partition("="))
        if not sign:
            raise ClipError(f"settings: {part!r} is not name=value")
        try:
            settings[name] = json.loads(word)
        except json.JSONDecodeError:
            settings[name] = word
    return settings


def _refuse_duplicates(rows: list[Row]) -> None:
    """Refuses clips whose results would overwrite each other or be mixed up.

    `patchlock score` ignores case and punctuation in names, so names must differ in more than that.
    """
    seen: dict[tuple[Any, ...], Row] = {}
    names: dict[str, str] = {}
    for row in rows:
        plain = re.sub(r"[-_ ]", ".", row.name).lower()
        if names.setdefault(plain, row.name) != row.name:
            raise ManifestError(
                f"the names {names[plain]} and {row.name} are one when they are scored: give them others"
            )
        if isinstance(row, Clip):
            key = (row.name, row.seed, json.dumps(dict(row.settings), sort_keys=True, default=str))
            if key in seen:
                raise ManifestError(
                    f"two clips have the name {row.name} (and the same seed and settings): "
                    "give each its own name"
                )
            seen[key] = row


def _list(numbers: Iterable[Any]) -> str:
    return ",".join(str(number) for number in numbers)
