"""Batches on a real Ray cluster of two nodes, one of which is killed during the batch."""

from __future__ import annotations

import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from patchlock.batch import Clip, run

ray = pytest.importorskip("ray", reason="Ray is an extra")
from ray.cluster_utils import Cluster  # noqa: E402

from patchlock.batch.ray import Ray  # noqa: E402

from .conftest import QUICK, boxes_below, leftovers, manifests_below, quick

pytestmark = pytest.mark.slow(25)

MEMORY = 80 * 2**20
SLOW = quick(400)
"""A clip takes long enough that a node is always killed during one."""
HURRY = {
    "health_check_initial_delay_ms": 500,
    "health_check_period_ms": 500,
    "health_check_timeout_ms": 1000,
    "health_check_failure_threshold": 3,
}
"""A node is considered dead after two seconds without an answer; Ray's default is longer."""


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    head = {"num_cpus": 1, "include_dashboard": False, "object_store_memory": MEMORY, "_system_config": HURRY}
    cluster = Cluster(initialize_head=True, head_node_args=head)
    yield cluster
    cluster.shutdown()


class CountingRay(Ray):
    """Counts submitted runs; each run creates a file whose name holds its node and process."""

    submitted = 0

    def __init__(self, address: str, marks: Path) -> None:
        super().__init__(address)
        self.marks = marks
        marks.mkdir()

    def __enter__(self) -> CountingRay:
        super().__enter__()
        marks = str(self.marks)

        # The imports are inside because Ray sends only the function; the nodes do not have this file.
        def marked(job: str) -> Any:
            import os
            import pathlib
            import uuid

            import ray

            from patchlock.batch.task import execute

            node = ray.get_runtime_context().get_node_id()
            (pathlib.Path(marks) / f"{node}-{os.getpid()}-{uuid.uuid4()}").touch()
            return execute(job)

        self._task = ray.remote(marked).options(num_cpus=self.threads, max_retries=0)
        return self

    def submit(self, key: int, job: str) -> None:
        self.submitted += 1
        super().submit(key, job)


def kill_when_it_begins_a_run(node: Any, marks: Path, out: Path) -> None:
    """Kills a node just after it has started a run.

    Kills the raylet and the worker process, which would otherwise live for another second.
    """
    end = time.monotonic() + 60
    before = None
    while time.monotonic() < end:
        begun = set(marks.glob(f"{node.node_id}-*"))
        if before is not None and begun - before:
            os.kill(node.all_processes["raylet"][0].process.pid, signal.SIGKILL)
            for mark in begun - before:
                os.kill(int(mark.name.split("-")[1]), signal.SIGKILL)
            return
        if before is None and boxes_below(out):
            before = begun
        time.sleep(0.005)


def test_killing_a_node_does_not_change_the_results(tmp_path: Path, clips: list[Clip], cluster: Any) -> None:
    local = run(clips, tmp_path / "local", progress=False, config=SLOW)
    second = cluster.add_node(num_cpus=1, object_store_memory=MEMORY)
    assert len(cluster.list_all_nodes()) == 2
    out, marks = tmp_path / "ray", tmp_path / "marks"
    with CountingRay(cluster.address, marks) as engine:
        assert engine.slots == 2
        killer = threading.Thread(target=kill_when_it_begins_a_run, args=[second, marks, out])
        killer.start()
        summary = run(clips, out, engine=engine, progress=False, config=SLOW)
        killer.join()
        nodes = {path.name.split("-")[0] for path in marks.iterdir()}
    print(
        f"local: {local}\nray: {summary}\nsubmitted {engine.submitted} times, started on {len(nodes)} nodes"
    )
    assert len(nodes) == 2
    assert (summary.done, summary.kept, summary.failed) == (12, 0, [])
    assert engine.submitted > 12, "the node was killed in the middle of a run"
    assert boxes_below(out) == boxes_below(tmp_path / "local")
    assert manifests_below(out) == manifests_below(tmp_path / "local")
    assert len(boxes_below(out)) == 12 and not leftovers(out)


def test_a_cluster_by_address_with_failing_clips(tmp_path: Path, clips: list[Clip], cluster: Any) -> None:
    broken = Clip(tmp_path / "nowhere.mp4", clips[0].box, name="missing")
    summary = run(
        [broken, *clips[:2]],
        tmp_path / "ray",
        engine="ray",
        address=cluster.address,
        progress=False,
        config=QUICK,
    )
    assert summary.done == 2 and not ray.is_initialized()
    assert [(failure.name, "no file or folder" in failure.message) for failure in summary.failed] == [
        ("missing", True)
    ]


def test_a_missing_cluster_is_reported(tmp_path: Path, clips: list[Clip]) -> None:
    with pytest.raises(ConnectionError, match=r"can't connect to a Ray cluster at 127\.0\.0\.1:1"):
        run(clips, tmp_path, engine="ray", address="127.0.0.1:1", progress=False, config=QUICK)
    with pytest.raises(ValueError, match="jobs is 2"):
        run(clips, tmp_path, engine="ray", jobs=2, progress=False, config=QUICK)


@pytest.mark.parametrize("answer", [b"HTTP/1.1 400 Bad Request\r\n\r\n", b""])
def test_another_server_is_no_cluster(tmp_path: Path, clips: list[Clip], answer: bytes) -> None:
    """Ray itself would try for 20 minutes."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"

        def serve() -> None:
            stream, _ = server.accept()
            with stream:
                stream.sendall(answer)
                # Where nothing is answered, nothing is closed either.
                time.sleep(0 if answer else 12)

        threading.Thread(target=serve, daemon=True).start()
        begin = time.monotonic()
        with pytest.raises(ConnectionError, match=f"at {address}: something else than Ray listens there"):
            run(clips, tmp_path, engine="ray", address=address, progress=False, config=QUICK)
        assert time.monotonic() - begin < 15
