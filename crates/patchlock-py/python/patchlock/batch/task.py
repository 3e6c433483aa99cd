"""One run, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from patchlock import _patchlock

if TYPE_CHECKING:
    from patchlock._patchlock import Store


@dataclass(frozen=True)
class Task:
    """A run that is to be made. Only its job travels; the rest stays with who asked for it."""

    name: str
    """The name of the clip, or of the target."""
    run: str
    """Which run on it, such as `seed 0`."""
    job: str
    """The message that says all that is needed to make it."""
    store: Store
    """Where it is kept."""


@dataclass(frozen=True)
class Made:
    """The files of a complete run."""

    boxes: str
    manifest: str

    @property
    def frames(self) -> int:
        """How many frames were tracked."""
        return self.boxes.count("\n")


@dataclass(frozen=True)
class Failed:
    """A run that is not possible, and would not be possible again."""

    message: str


@dataclass(frozen=True)
class Lost:
    """A run whose process or machine went away: another try may bring it."""

    message: str


Outcome: TypeAlias = Made | Failed | Lost


def make(job: str) -> Made | Failed:
    """Makes a run, here and now."""
    try:
        return Made(*_patchlock.track_job(job))
    except Exception as error:
        return Failed(str(error))
