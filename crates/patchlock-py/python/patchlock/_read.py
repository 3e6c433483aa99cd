"""Reads tables that `patchlock track --save` has written."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from patchlock._patchlock import _read_estimates

if TYPE_CHECKING:
    from patchlock._patchlock import Estimate


def read_track(file: str | os.PathLike[str]) -> list[Estimate]:
    """Reads a table of one target, saved by `patchlock track`.

    ```python
    for estimate in patchlock.read_track("track.csv"):
        print(estimate.frame, estimate.box, estimate.status)
    ```

    A lost target without a box, as with `--lost blank`, has its last known one. Numbers have six decimal
    places. The table has no maps of visible patches: `Estimate.visibility` is `None`.

    Args:
        file: A `.csv` or `.jsonl` file.

    Returns:
        The estimates, ordered by frame, as `track` yields them.

    Raises:
        ValueError: The file is not such a table, or has several targets, which `read_tracks` reads.
        OSError: The file can't be read.
    """
    rows = _read_estimates(file)
    ids = sorted({number for number, _ in rows})
    if len(ids) > 1:
        shown = ", ".join(map(str, ids[:5])) + (", ..." if len(ids) > 5 else "")
        raise ValueError(f"{os.fspath(file)} has {len(ids)} targets: {shown}; patchlock.read_tracks reads all")
    return [estimate for _, estimate in rows]


def read_tracks(file: str | os.PathLike[str]) -> list[dict[int, Estimate]]:
    """Reads a table of many targets, saved by `patchlock track`.

    The estimates are those of `read_track`. A table of one target without a column `id` has the id 1.

    Args:
        file: A `.csv` or `.jsonl` file.

    Returns:
        For each frame with a line, in order, an estimate for each id, as `track` with `boxes` yields them.

    Raises:
        ValueError: The file is not such a table.
        OSError: The file can't be read.
    """
    frames: dict[int, dict[int, Estimate]] = {}
    for number, estimate in _read_estimates(file):
        frames.setdefault(estimate.frame, {})[number] = estimate
    return list(frames.values())
