"""The engine for many machines: an existing Ray cluster. Ray is an extra: `pip install ray`."""

from __future__ import annotations

import socket
import warnings
from types import TracebackType
from typing import TYPE_CHECKING, Any

from patchlock.batch.task import Failed, Lost, Outcome, execute

if TYPE_CHECKING:
    from typing_extensions import Self

# Seconds to wait for the first answer of a cluster.
_PATIENCE = 10
# The type of a frame of settings in HTTP/2.
_SETTINGS = 4
# Runs submitted in advance, so that no machine waits for its next run.
_AHEAD = 4


class Ray:
    """The machines of a Ray cluster.

    Each run is a Ray task that takes `threads` CPUs. Ray's own retries are disabled: `drive` counts the
    attempts, as for local processes. Only this process writes results, so a run that was executed twice,
    because a machine was wrongly considered dead, is stored once.
    """

    def __init__(self, address: str | None = None, threads: int = 1) -> None:
        """Connects to a cluster.

        Args:
            address: As for `ray.init`, such as `10.0.0.1:6379`; `None` for the cluster of this machine.
            threads: Threads of each run.

        Raises:
            ValueError: `threads` is less than 1.
            ImportError: Ray is not installed.
        """
        if threads < 1:
            raise ValueError(f"threads is {threads}; it must be at least 1")
        try:
            import ray
        except ImportError as error:
            raise ImportError('the engine "ray" needs Ray: pip install ray') from error
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
                raise ConnectionError(
                    f"can't connect to a Ray cluster at {self._address}: {error} "
                    "(start one with: ray start --head)"
                ) from error
            self._own = True
        task = self._ray.remote(execute)
        self._task = task.options(name="patchlock", num_cpus=self._threads, max_retries=0)
        if not any(
            node["Resources"].get("CPU", 0) >= self._threads for node in self._ray.nodes() if node["Alive"]
        ):
            warnings.warn(
                f"no machine of the cluster has {self._threads} CPUs; the runs wait until one joins",
                stacklevel=2,
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for run in self._running:
            self._ray.cancel(run, force=True)
        self._running.clear()
        if self._own:
            self._ray.shutdown()

    @property
    def slots(self) -> int:
        """How many runs the cluster can currently execute in parallel."""
        return max(1, int(self._ray.cluster_resources().get("CPU", 0)) // self._threads)

    @property
    def room(self) -> int:
        """A few more than `slots`, which follows the current size of the cluster."""
        return self.slots + _AHEAD

    @property
    def threads(self) -> int:
        """Threads of each run."""
        return self._threads

    def submit(self, key: int, job: str) -> None:
        """Submits a run to the cluster."""
        self._running[self._task.remote(job)] = key

    def wait(self) -> list[tuple[int, Outcome]]:
        """Waits for the next run to finish."""
        ended, _ = self._ray.wait(list(self._running), num_returns=1)
        return [(self._running.pop(run), self._outcome(run)) for run in ended]

    def _outcome(self, run: Any) -> Outcome:
        try:
            outcome: Outcome = self._ray.get(run)
        except self._ray.exceptions.RayTaskError as error:
            # `execute` itself never raises, so Patchlock is missing on a machine, or its version differs.
            return Failed(f"a machine of the cluster can't run Patchlock: {_last_line(error)}")
        except self._ray.exceptions.RayError as error:
            return Lost(f"its machine or process died: {type(error).__name__}")
        return outcome


def _knock(address: str) -> None:
    """Fails soon if no Ray cluster listens at the address; Ray itself would try for minutes.

    A cluster speaks gRPC: as every server of HTTP/2, it answers the first bytes of a client with a frame
    of settings.
    """
    host, colon, port = address.rpartition(":")
    if not (colon and port.isdecimal()):
        return
    with socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE) as stream:
        stream.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, _SETTINGS, 0, 0, 0, 0, 0]))
        try:
            with stream.makefile("rb") as answer:
                head = answer.read(9)
        except TimeoutError:
            head = b""
    if len(head) < 9 or head[3] != _SETTINGS:
        raise ConnectionError("something else than Ray listens there")


def _last_line(error: Exception) -> str:
    return str(error).strip().splitlines()[-1]
