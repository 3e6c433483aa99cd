"""The engine for one machine: worker processes, each executing one run at a time.

The workers are started with `subprocess` rather than `multiprocessing`. So a script needs no
`if __name__ == "__main__"`, and if a worker is killed, only its run is lost and a new worker replaces it.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass, field
from types import TracebackType
from typing import TYPE_CHECKING

from patchlock.batch.task import Failed, Lost, Made, Outcome

if TYPE_CHECKING:
    from typing_extensions import Self


_PATIENCE = 5.0
"""Seconds in which a worker ends when its input has ended."""


@dataclass(eq=False)
class _Worker:
    """A process, and the thread that reads its output."""

    process: subprocess.Popen[str]
    key: int | None = None
    listener: threading.Thread = field(init=False)

    def hand(self, key: int, job: str) -> None:
        self.key = key
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):  # if the process is gone, its listener reports it
            self.process.stdin.write(job + "\n")
            self.process.stdin.flush()

    def end(self) -> None:
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        # It then removes what it has begun to write.
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(_PATIENCE)
        self.process.kill()
        self.listener.join()
        with contextlib.suppress(OSError), self.process:
            pass  # closes the pipes; input that the process has not read can't be flushed


class Local:
    """Processes on this machine."""

    def __init__(self, jobs: int | None = None, threads: int = 1) -> None:
        """Creates the engine; workers are started when needed.

        Args:
            jobs: Number of parallel runs; `None` for one per `threads` cores.
            threads: Threads of each run.

        Raises:
            ValueError: A number is less than 1.
        """
        for name, value in (("jobs", jobs), ("threads", threads)):
            if value is not None and value < 1:
                raise ValueError(f"{name} is {value}; it must be at least 1")
        self._slots = jobs or max(1, _processors() // threads)
        self._threads = threads
        self._workers: list[_Worker] = []
        self._ended: queue.SimpleQueue[tuple[_Worker, Outcome]] = queue.SimpleQueue()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for worker in self._workers:
            worker.end()
        self._workers.clear()

    @property
    def slots(self) -> int:
        """How many runs execute in parallel."""
        return self._slots

    @property
    def room(self) -> int:
        """The same as `slots`: runs are not queued in the workers."""
        return self._slots

    @property
    def threads(self) -> int:
        """Threads of each run."""
        return self._threads

    def submit(self, key: int, job: str) -> None:
        """Passes a run to an idle worker, or to a new one."""
        idle = next((worker for worker in self._workers if worker.key is None), None)
        (idle or self._start()).hand(key, job)

    def wait(self) -> list[tuple[int, Outcome]]:
        """Waits for the next run to finish."""
        while True:
            worker, outcome = self._ended.get()
            key, worker.key = worker.key, None
            if isinstance(outcome, Lost):
                self._workers.remove(worker)
                worker.end()
            if key is not None:  # otherwise the worker died while idle
                return [(key, outcome)]

    def _start(self) -> _Worker:
        command = [sys.executable, "-m", "patchlock.batch.worker"]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8")
        worker = _Worker(process)
        worker.listener = threading.Thread(target=self._listen, args=[worker], daemon=True)
        worker.listener.start()
        self._workers.append(worker)
        return worker

    def _listen(self, worker: _Worker) -> None:
        assert worker.process.stdout is not None
        for line in worker.process.stdout:
            if not line.endswith("\n"):
                break  # killed in the middle of its answer
            answer = json.loads(line)
            self._ended.put((worker, Failed(**answer) if "message" in answer else Made(**answer)))
        self._ended.put((worker, Lost(_how_it_ended(worker.process.wait()))))


def _processors() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _how_it_ended(code: int) -> str:
    if code >= 0:
        return f"its process ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"its process was ended by {name}" + (
        ", as the system does when memory runs out" if name == "SIGKILL" else ""
    )
