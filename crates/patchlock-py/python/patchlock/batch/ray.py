"""The engine of many machines: Ray, which is an extra (`pip install "patchlock[ray]"`), on a cluster that runs already."""

from __future__ import annotations

import socket
import warnings
from types import TracebackType
from typing import TYPE_CHECKING, Any

from patchlock.batch.task import Failed, Lost, Outcome, make

if TYPE_CHECKING:
    from typing_extensions import Self

# So many runs more than there is room for are handed in, so that no machine waits for the next one.
_AHEAD = 4


class Ray:
    """The machines of a Ray cluster.

    Each run is a task of Ray that takes `threads` processors. Ray is told to try nothing twice: `drive` counts the tries, as it does for processes
    of one machine. What a run gives comes back to this process, which alone writes it: a run that was made twice, because a machine was
    taken for dead, is still kept once.
    """

    def __init__(self, address: str | None = None, threads: int = 1) -> None:
        """`address` as `ray.init` takes it, such as `10.0.0.1:6379`; without one, the cluster that this machine is part of."""
        if threads < 1:
            raise ValueError(f"threads is {threads}; it must be at least 1")
        try:
            import ray
        except ImportError as error:
            raise ImportError('the engine "ray" needs Ray: pip install "patchlock[ray]"') from error
        self._ray = ray
        self._address = address or "auto"
        self._threads = threads
        self._own = False
        self._running: dict[Any, int] = {}

    def __enter__(self) -> Self:
        if not self._ray.is_initialized():
            try:
                _knock(self._address)
                self._ray.init(address=self._address, log_to_driver=False, logging_level="warning")
            except (OSError, OverflowError, ValueError, RuntimeError) as error:
                raise ConnectionError(f"no Ray cluster to use at {self._address}: {error} (begin one with: ray start --head)") from error
            self._own = True
        self._task = self._ray.remote(make).options(name="patchlock", num_cpus=self._threads, max_retries=0)
        if not any(node["Resources"].get("CPU", 0) >= self._threads for node in self._ray.nodes() if node["Alive"]):
            warnings.warn(f"no machine of the cluster has {self._threads} processors: the runs wait for one that has", stacklevel=2)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for run in self._running:
            self._ray.cancel(run, force=True)
        self._running.clear()
        if self._own:
            self._ray.shutdown()

    @property
    def slots(self) -> int:
        """How many runs the cluster has room for at present."""
        return max(1, int(self._ray.cluster_resources().get("CPU", 0)) // self._threads)

    @property
    def room(self) -> int:
        """A few runs more than go on, whatever the cluster has grown or shrunk to."""
        return self.slots + _AHEAD

    @property
    def threads(self) -> int:
        """Threads of each run."""
        return self._threads

    def submit(self, key: int, job: str) -> None:
        """Hands a run to the cluster."""
        self._running[self._task.remote(job)] = key

    def wait(self) -> list[tuple[int, Outcome]]:
        """Waits for the next run that ends."""
        ended, _ = self._ray.wait(list(self._running), num_returns=1)
        return [(self._running.pop(run), self._outcome(run)) for run in ended]

    def _outcome(self, run: Any) -> Outcome:
        try:
            outcome: Outcome = self._ray.get(run)
        except self._ray.exceptions.RayTaskError as error:
            # Nothing in `make` raises: a machine of the cluster has no Patchlock, or another one.
            return Failed(f"a machine of the cluster can't run Patchlock: {_last_line(error)}")
        except self._ray.exceptions.RayError as error:
            return Lost(f"its machine or process went away: {type(error).__name__}")
        return outcome


def _knock(address: str) -> None:
    """Says at once that nobody listens there: Ray itself tries for minutes."""
    host, colon, port = address.rpartition(":")
    if colon and port.isdecimal():
        socket.create_connection((host.strip("[]"), int(port)), timeout=10).close()


def _last_line(error: Exception) -> str:
    return str(error).strip().splitlines()[-1]
