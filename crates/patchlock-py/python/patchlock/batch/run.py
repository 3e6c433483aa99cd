"""Tracks the clips of a manifest, or the targets of a dataset, with an engine and stores the results."""

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
from patchlock.batch.manifest import Clip, ManifestError, Row, InvalidRow, is_folder_name, read
from patchlock.batch.summary import Failure, Summary
from patchlock.batch.tables import write
from patchlock.batch.task import Failed, Task

if TYPE_CHECKING:
    from patchlock._patchlock import Config, Network, Store
    from patchlock._types import ModelLike

EngineLike = Literal["local", "ray"] | Engine


def run(
    manifest: str | os.PathLike[str] | Iterable[Clip],
    out: str | os.PathLike[str],
    *,
    engine: EngineLike = "local",
    address: str | None = None,
    jobs: int | None = None,
    threads: int = 1,
    config: Config | None = None,
    preset: str | None = None,
    model: Network | ModelLike | None = None,
    runtime: str | os.PathLike[str] | None = None,
    name: str | None = None,
    tables: str | os.PathLike[str] | None = None,
    videos: str | os.PathLike[str] | None = None,
    retries: int = 2,
    progress: bool | None = None,
) -> Summary:
    """Tracks every clip of a manifest and stores the results in the format of `patchlock bench`.

    Results that are already complete are kept, so an interrupted call can be repeated and continues where it
    stopped. A clip that fails does not stop the others.

    Args:
        manifest: A `.csv` or `.jsonl` file with one clip per line, or `Clip`s. Paths in a file are relative
            to its folder.
        out: Folder for the results: `<out>/<name>/ope/<clip>/<seed>.txt` and `.json`. Only this process
            writes to it.
        engine: `"local"` for processes on this machine, `"ray"` for a Ray cluster whose machines have the
            sources under the same paths, or an `Engine`.
        address: The Ray cluster, such as `"10.0.0.1:6379"`; `None` for the cluster of this machine.
        jobs: Number of parallel runs on this machine; `None` for one per `threads` cores.
        threads: Threads of each run. 1 gives the most frames per second over all clips.
        config: A `patchlock.Config`; `None` for the preset `robust`.
        preset: The name of a preset, instead of `config`.
        model: The network, as for `patchlock.track`. Runs load one from a folder or file under the same path
            on all machines.
        runtime: What runs the network, as for `patchlock.Network`.
        name: Name of the results; by default that of the preset, followed by a hash of the settings if they
            differ from it. The results of clips with their own settings go to separate folders, whose names
            end in such a hash too.
        tables: Folder for a table `<clip>.csv` and a summary `<clip>.json` of each complete clip, made if it
            is missing; files of the same names are replaced.
        videos: Folder for a video `<clip>.mp4` of each clip with the track drawn in, as `patchlock track
            --video` draws it; made if it is missing. The process that tracks a clip writes it, so on a cluster
            the folder must have the same path on all machines. A clip without its video is tracked again.
        retries: How often a clip is retried if its process or machine died.
        progress: Whether to show a `tqdm` progress bar; `None` shows it only on a terminal.

    Returns:
        The summary, which is also written to `<out>/batch.json`. `Summary.failed` lists the clips that
        failed, with the reasons.

    Raises:
        ValueError: The manifest, a setting or the network is invalid, or `out` holds results of other
            settings.
        OSError: A file of the network can't be read.
        ConnectionError: The Ray cluster can't be reached.
    """
    rows = read(manifest)
    stores = _Stores(Path(out), _patchlock._checked_config(config, preset, model, runtime), name)
    with _engine(engine, address, jobs, threads) as machine:
        batch = _Batch(Path(out), engine, machine, retries, progress)
        batch.tables = None if tables is None else Path(tables)
        tasks = []
        for row in rows:
            try:
                task = _task(row, stores, machine, None if videos is None else Path(videos).absolute())
                if task.store.holds(task.job):
                    batch.summary.kept += 1
                    batch.write_tables(task)
                else:
                    tasks.append(task)
            except (ValueError, TypeError, OSError) as error:
                batch.fail(Failure(row.name, "", str(error)))
        batch.summary.folders = stores.folders()
        return batch.execute(tasks)


def bench(
    dataset: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    engine: EngineLike = "local",
    address: str | None = None,
    jobs: int | None = None,
    threads: int = 1,
    protocol: Literal["ope", "tre", "sre"] = "ope",
    preset: str = "robust",
    file: str | os.PathLike[str] | None = None,
    model: str | os.PathLike[str] | None = None,
    runtime: str | os.PathLike[str] | None = None,
    command: str | None = None,
    timeout: int = 60,
    name: str | None = None,
    seeds: int = 1,
    sequences: Sequence[str] = (),
    attributes: Sequence[str] = (),
    retries: int = 2,
    progress: bool | None = None,
) -> Summary:
    """Does the same as `patchlock bench`, but an engine executes the runs. The files and boxes are the same.

    Args:
        dataset: The folder with the sequences, in a layout that `patchlock dataset` recognises.
        out: Folder for the results; `patchlock score` and `patchlock report` read it.
        protocol: Where tracking starts: `"ope"` (the first frame), `"tre"` (20 start frames) or `"sre"`
            (12 shifted or scaled first boxes).
        preset: The preset to start from.
        file: A TOML file with settings that differ from the preset.
        model: The network, as for `patchlock.track`: `"patchnet"` (the default), `"none"`, a folder with its
            ONNX files, or its only file. It takes precedence over that of `file`.
        runtime: What runs the network, as for `patchlock.Network`.
        name: Name of the results; by default that of the settings file, or of the preset.
        command: Runs another tracker, a program that implements the TraX protocol. Requires a `name`.
        timeout: Seconds to wait for each answer of that program, 1 to 86400.
        seeds: Number of seeds for each target, 1 to 10000.
        sequences: Only these targets, or all targets of these sequences.
        attributes: Only targets that have at least one of these attributes.

    `engine`, `address`, `jobs`, `threads`, `retries` and `progress` are as for `run`.

    Returns:
        The summary, which is also written to `<out>/batch.json`.

    Raises:
        ValueError: An argument is invalid, or `out` holds results of other settings.
        OSError: The dataset or a file of the network can't be read.
    """
    with _engine(engine, address, jobs, threads) as machine:
        batch = _Batch(Path(out), engine, machine, retries, progress)
        store, named, before, failures = _patchlock.bench_jobs(
            dataset,
            out,
            protocol=protocol,
            preset=preset,
            file=file or None,
            model=model or None,
            runtime=runtime or None,
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
        return batch.execute([Task(target, label, job, store) for target, label, job in named])


def _engine(engine: EngineLike, address: str | None, jobs: int | None, threads: int) -> Engine:
    if not isinstance(engine, str):
        return engine
    if engine == "local":
        if address is not None:
            raise ValueError(f'address is {address}, but only the engine "ray" has an address')
        return Local(jobs, threads)
    if engine == "ray":
        from patchlock.batch.ray import Ray

        if jobs is not None:
            raise ValueError(
                f"jobs is {jobs}, but a Ray cluster sets the number of parallel runs itself; "
                "threads is the number of CPUs of each run"
            )
        return Ray(address, threads)
    raise ValueError(f'there is no engine {engine!r}; the engines are "local" and "ray"')


class _Stores:
    """The results folder of each configuration, opened for its first clip."""

    def __init__(self, out: Path, config: Config, name: str | None) -> None:
        self._out, self._config, self._name = out, config, name or None
        if name and not is_folder_name(name):
            raise ManifestError(f"name is {name!r}, which is not a valid name of a folder")
        self._open: dict[str, Store] = {}
        self.of({})  # reports invalid common settings here rather than once per clip

    def of(self, own: Any) -> Store:
        """The folder for clips with these settings."""
        key = repr(sorted(own.items()))
        if key not in self._open:
            self._open[key] = _patchlock.Store(
                self._out, self._name, config=self._config, own=dict(own)
            )
        return self._open[key]

    def folders(self) -> list[str]:
        return list(dict.fromkeys(str(store.folder) for store in self._open.values()))


def _task(row: Row, stores: _Stores, machine: Engine, videos: Path | None) -> Task:
    if isinstance(row, InvalidRow):
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
        video=None if videos is None else videos / f"{row.name}.mp4",
    )
    return Task(row.name, f"seed {seed}", job, store)


class _Batch:
    """Executes runs with a progress bar and a summary."""

    def __init__(
        self, out: Path, engine: EngineLike, machine: Engine, retries: int, progress: bool | None
    ) -> None:
        if retries < 0:
            raise ValueError(f"retries is {retries}; it must be 0 or more")
        named = engine if isinstance(engine, str) else type(engine).__name__
        self.summary = Summary(named, machine.slots)
        self._out, self._machine, self._retries = out, machine, retries
        self.tables: Path | None = None
        self._hidden = None if progress is None else not progress

    def fail(self, failure: Failure) -> None:
        """Records a run that failed, and prints it if there is a progress bar."""
        self.summary.failed.append(failure)
        if self._hidden is False or (self._hidden is None and sys.stderr.isatty()):
            tqdm.write(f"failed: {failure}", file=sys.stderr)

    def write_tables(self, task: Task) -> None:
        """Writes table and summary of a run that is stored, if they are wanted."""
        if self.tables is not None:
            write(self.tables, task)

    def execute(self, tasks: list[Task]) -> Summary:
        """Executes the runs. The summary is written even if this is interrupted."""
        begin = time.monotonic()
        self.summary.left = len(tasks)
        try:
            with tqdm(total=len(tasks), unit="run", disable=self._hidden) as bar:
                for task, outcome in drive(self._machine, tasks, self._retries):
                    if isinstance(outcome, Failed):
                        self.fail(Failure(task.name, task.run, outcome.message))
                    else:
                        task.store.keep(task.job, outcome.boxes, outcome.manifest)
                        self.write_tables(task)
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
