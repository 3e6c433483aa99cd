"""A run and its outcome."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from patchlock import _patchlock

if TYPE_CHECKING:
    from patchlock._patchlock import Store


@dataclass(frozen=True)
class Task:
    """A run to execute. Only `job` is sent to the worker."""

    name: str
    """The name of the clip, or of the target."""
    run: str
    """Which run on it, such as `seed 0`."""
    job: str
    """A JSON message with everything that is needed to execute the run."""
    store: Store
    """Where the results are stored."""


@dataclass(frozen=True)
class Made:
    """The files of a complete run."""

    boxes: str
    manifest: str

    @property
    def frames(self) -> int:
        """Number of tracked frames."""
        return self.boxes.count("\n")


@dataclass(frozen=True)
class Failed:
    """A run that failed for good: a retry would fail in the same way."""

    message: str


@dataclass(frozen=True)
class Lost:
    """A run whose process or machine died: a retry may succeed."""

    message: str


Outcome: TypeAlias = Made | Failed | Lost


def execute(job: str) -> Made | Failed:
    """Executes a run in this process. It never raises."""
    try:
        return Made(*_patchlock.track_job(job))
    except Exception as error:
        return Failed(str(error))
