"""From clips, or from a dataset, through an engine to results on disk."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tqdm import tqdm

from patchlock import _patchlock
from patchlock.batch.engine import Engine, drive
from patchlock.batch.local import Local
from patchlock.batch.manifest import Clip, ManifestError, Row, Unreadable, read
from patchlock.batch.summary import Failure, Summary
from patchlock.batch.task import Failed, Task

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from patchlock._patchlock import Store
    from patchlock._settings import Settings

EngineLike = Literal["local", "ray"] | Engine


def run(
    manifest: str | os.PathLike[str] | Iterable[Clip],
    out: str | os.PathLike[str],
    *,
    engine: EngineLike = "local",
    address: str | None = None,
    jobs: int | None = None,
    threads: int = 1,
    preset: str = "paper",
    config: str | os.PathLike[str] | None = None,
    name: str | None = None,
    retries: int = 2,
    progress: bool | None = None,
    **overrides: Unpack[Settings],
) -> Summary:
    """Tracks each clip of a manifest, and keeps its boxes as `patchlock bench` does.

    What is there already, complete, is not made again, so that the same call goes on after it was stopped in whatever way. A clip that fails
    holds nobody up.

    Args:
        manifest: A file that ends in `.csv` or `.jsonl`, with a clip a line, or `Clip`s. Paths in a file begin at its folder.
        out: Folder for the results: `<out>/<name>/ope/<clip>/<seed>.txt` and `.json`. Only this process writes to it.
        engine: `"local"`: processes of this machine. `"ray"`: a Ray cluster, whose machines find the sources under the same paths. Or an `Engine`.
        address: The Ray cluster, such as `"10.0.0.1:6379"`; `None` for the one that this machine is part of.
        jobs: Runs side by side on this machine; `None` for as many as there are processors for.
        threads: Threads of each run. 1 gives the most frames a second over all clips.
        preset: The settings to begin with.
        config: A TOML file with settings that differ.
        name: Name of the results; by default that of the settings file, or of the preset. Clips with settings of their own get folders of their own,
            called after the settings' hash.
        retries: How often a clip is tried again whose process or machine went away.
        progress: A bar of `tqdm`; `None` shows it on a terminal only.
        **overrides: Settings that differ, such as `particles=200`.

    Returns:
        The summary, which is in `<out>/batch.json` too. `Summary.failed` names each clip that failed, with the reason.

    Raises:
        ValueError: The manifest or the settings are wrong, or `out` holds results of other settings.
        ConnectionError: There is no Ray cluster.
    """
    rows = read(manifest)
    stores = _Stores(Path(out), preset, config, name, overrides)
    with _engine(engine, address, jobs, threads) as machine:
        batch = _Batch(Path(out), engine, machine, retries, progress)
        tasks = []
        for row in rows:
            try:
                task = _task(row, stores, machine)
                if task.store.holds(task.job):
                    batch.summary.kept += 1
                else:
                    tasks.append(task)
            except (ValueError, TypeError, OSError) as error:
                batch.fail(Failure(row.name, "", str(error)))
        batch.summary.folders = stores.folders()
        return batch.make(tasks)


def bench(
    dataset: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    engine: EngineLike = "local",
    address: str | None = None,
    jobs: int | None = None,
    threads: int = 1,
    protocol: Literal["ope", "tre", "sre"] = "ope",
    preset: str = "paper",
    config: str | os.PathLike[str] | None = None,
    command: str | None = None,
    timeout: int = 60,
    name: str | None = None,
    seeds: int = 1,
    sequences: Sequence[str] = (),
    attributes: Sequence[str] = (),
    retries: int = 2,
    progress: bool | None = None,
) -> Summary:
    """Does what `patchlock bench` does, with the runs made by an engine: the same boxes in the same files.

    Args:
        dataset: The folder with the sequences, in a layout that `patchlock dataset` recognises.
        out: Folder for the results; `patchlock score` and `patchlock report` read it.
        protocol: Where the tracker begins: the first frame, 20 start frames, or 12 first boxes.
        command: Another tracker, a program that speaks TraX, instead of ours. It needs a `name`.
        timeout: Seconds to wait for each answer of that program.
        seeds: Number of seeds to run each target with.
        sequences: Only these targets, or all targets of these sequences.
        attributes: Only targets that have at least one of these attributes.

    `engine`, `address`, `jobs`, `threads`, `preset`, `config`, `name`, `retries` and `progress` are as in `run`.

    Returns:
        The summary, which is in `<out>/batch.json` too.

    Raises:
        ValueError: A choice makes no sense, or `out` holds results of other settings.
        OSError: The dataset can't be read.
    """
    with _engine(engine, address, jobs, threads) as machine:
        batch = _Batch(Path(out), engine, machine, retries, progress)
        store, named, before, failures = _patchlock.bench_jobs(
            dataset,
            out,
            protocol=protocol,
            preset=preset,
            config=config or None,
            command=command,
            timeout=timeout,
            name=name or None,
            seeds=seeds,
            sequences=list(sequences),
            attributes=list(attributes),
            threads=machine.threads,
            side_by_side=machine.slots,
        )
        batch.summary.kept = before
        batch.summary.folders = [str(store.folder)]
        for failure in failures:
            batch.fail(Failure(*failure))
        return batch.make([Task(target, label, job, store) for target, label, job in named])


def _engine(engine: EngineLike, address: str | None, jobs: int | None, threads: int) -> Engine:
    if not isinstance(engine, str):
        return engine
    if engine == "local":
        if address is not None:
            raise ValueError(f'address is {address}, which only the engine "ray" has')
        return Local(jobs, threads)
    if engine == "ray":
        from patchlock.batch.ray import Ray

        if jobs is not None:
            raise ValueError(f"jobs is {jobs}, but a cluster runs as many side by side as it has processors; threads says how many a run takes")
        return Ray(address, threads)
    raise ValueError(f'there is no engine {engine!r}; there are "local" and "ray"')


class _Stores:
    """The folder of each configuration, opened when its first clip comes."""

    def __init__(
        self, out: Path, preset: str, config: str | os.PathLike[str] | None, name: str | None, overrides: Any
    ) -> None:
        self._out, self._preset, self._config = out, preset, config
        self._name = name or (Path(config).stem if config is not None else preset)
        if not self._name or self._name.startswith(".") or "/" in self._name or "\\" in self._name:
            raise ManifestError(f"name is {self._name!r}: it is the name of a folder in out")
        self._base = dict(overrides)
        self._open: dict[str, Store] = {}
        self.of({})  # what is wrong with the settings of all is no fault of a clip

    def of(self, own: Any) -> Store:
        """The folder for clips with these settings."""
        key = repr(sorted(own.items()))
        if key not in self._open:
            self._open[key] = _patchlock.Store(
                self._out, self._name, preset=self._preset, config=self._config, base=self._base, own=dict(own)
            )
        return self._open[key]

    def folders(self) -> list[str]:
        return list(dict.fromkeys(str(store.folder) for store in self._open.values()))


def _task(row: Row, stores: _Stores, machine: Engine) -> Task:
    if isinstance(row, Unreadable):
        raise ManifestError(row.message)
    row.check()
    box = row.first_box()
    # The seed belongs to the run rather than to the configuration.
    own = {name: value for name, value in row.settings.items() if name != "seed"}
    store = stores.of(own)
    seed = next((s for s in (row.seed, row.settings.get("seed")) if s is not None), store.first_seed)
    job = store.clip(
        row.name,
        seed,
        box,
        source=os.fspath(row.source),
        path=row.path,
        start=row.start,
        end=row.end,
        stride=row.stride,
        threads=machine.threads,
        side_by_side=machine.slots,
    )
    return Task(row.name, f"seed {seed}", job, store)


class _Batch:
    """Runs on their way, with a bar and a summary."""

    def __init__(self, out: Path, engine: EngineLike, machine: Engine, retries: int, progress: bool | None) -> None:
        if retries < 0:
            raise ValueError(f"retries is {retries}; it must be 0 or more")
        named = engine if isinstance(engine, str) else type(engine).__name__
        self.summary = Summary(named, machine.slots)
        self._out, self._machine, self._retries = out, machine, retries
        self._hidden = None if progress is None else not progress

    def fail(self, failure: Failure) -> None:
        """Notes a run that is not possible, and says so at once where there is a bar."""
        self.summary.failed.append(failure)
        if self._hidden is False or (self._hidden is None and sys.stderr.isatty()):
            tqdm.write(f"failed: {failure}", file=sys.stderr)

    def make(self, tasks: list[Task]) -> Summary:
        """Makes the runs. However it ends, the summary of what was made is written."""
        begin = time.monotonic()
        self.summary.left = len(tasks)
        try:
            with tqdm(total=len(tasks), unit="run", disable=self._hidden) as bar:
                for task, outcome in drive(self._machine, tasks, self._retries):
                    if isinstance(outcome, Failed):
                        self.fail(Failure(task.name, task.run, outcome.message))
                    else:
                        task.store.keep(task.job, outcome.boxes, outcome.manifest)
                        self.summary.done += 1
                        self.summary.frames += outcome.frames
                    self.summary.left -= 1
                    speed = self.summary.frames / max(time.monotonic() - begin, 1e-9)
                    bar.set_postfix(failed=len(self.summary.failed), fps=f"{speed:.1f}", refresh=False)
                    bar.update()
        finally:
            self.summary.seconds = time.monotonic() - begin
            self.summary.write(self._out)
        return self.summary
