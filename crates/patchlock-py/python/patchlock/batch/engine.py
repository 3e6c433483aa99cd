"""The interface of engines, and the loop that submits runs to one."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Protocol

from patchlock.batch.task import Failed, Lost, Made, Outcome, Task

if TYPE_CHECKING:
    from typing_extensions import Self


class Engine(Protocol):
    """Executes runs. It is a context manager, entered before the first run and left after the last."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Cancels the runs that have not finished."""

    @property
    def slots(self) -> int:
        """How many runs execute in parallel."""

    @property
    def room(self) -> int:
        """How many runs may be submitted and unfinished at the same time."""

    @property
    def threads(self) -> int:
        """Threads of each run."""

    def submit(self, key: int, job: str) -> None:
        """Submits a run."""

    def wait(self) -> list[tuple[int, Outcome]]:
        """Waits until at least one run has finished; returns all that have, by key."""


@dataclass
class _Attempt:
    task: Task
    number: int


def drive(engine: Engine, tasks: Iterable[Task], retries: int) -> Iterator[tuple[Task, Made | Failed]]:
    """Executes all tasks and yields each once, when it finishes.

    A lost run is retried up to `retries` times.
    """
    new, again = iter(tasks), deque[_Attempt]()
    running: dict[int, _Attempt] = {}
    key = 0
    while True:
        while len(running) < engine.room:
            attempt = again.popleft() if again else next((_Attempt(task, 1) for task in new), None)
            if attempt is None:
                break
            engine.submit(key, attempt.task.job)
            running[key] = attempt
            key += 1
        if not running:
            return
        for ended, outcome in engine.wait():
            attempt = running.pop(ended)
            if not isinstance(outcome, Lost):
                yield attempt.task, outcome
            elif attempt.number <= retries:
                again.append(_Attempt(attempt.task, attempt.number + 1))
            else:
                yield attempt.task, Failed(f"{outcome.message}; it was tried {attempt.number} times")
