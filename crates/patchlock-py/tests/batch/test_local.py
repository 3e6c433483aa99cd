"""Batches on local processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from networks import NANOTRACK, VITTRACK, nanotrack_in

import patchlock
from patchlock.batch import Clip, Failed, Local, Lost, Made, Outcome, run
from patchlock.batch.engine import drive
from patchlock.batch.tables import _losses
from patchlock.batch.task import Task

from .conftest import QUICK, SETTINGS, boxes_below, leftovers, manifests_below, quick


def until(condition: Any, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "timed out"
        time.sleep(0.01)


TOO_LARGE = quick()
"""Settings that do not fit each other: a patch is larger than its template."""
TOO_LARGE.paper.patches.large_patch = 128


def write_manifest(folder: Path, clips: list[Clip]) -> Path:
    path = folder / "clips.jsonl"
    rows = [
        {"source": str(c.source), "box": c.box, "name": c.name, "seed": c.seed, "settings": SETTINGS}
        for c in clips
    ]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    return path


def test_each_clip_has_a_table_and_a_summary(tmp_path: Path, clips: list[Clip], frames: Path, box: Any) -> None:
    """They are those of `patchlock track`, as far as they go; also of a clip that was complete before."""
    part = Clip(frames, box, name="part", start=3, end=12, stride=2)
    tables = tmp_path / "tables"
    run([part], tmp_path / "out", jobs=1, progress=False, config=QUICK)
    assert not tables.exists()
    run([clips[1], part], tmp_path / "out", jobs=1, progress=False, config=QUICK, tables=tables)
    names = sorted(path.name for path in tables.iterdir())
    assert names == ["clip1.csv", "clip1.json", "part.csv", "part.json"]
    head, *rows = (tables / "part.csv").read_text().splitlines()
    assert head == "frame,x,y,w,h,score,ms,status"
    estimates = list(patchlock.track(frames, box, config=QUICK, start=3, end=12, stride=2))
    assert len(rows) == len(estimates) == 5
    for row, estimate in zip(rows, estimates, strict=True):
        frame, *numbers, ms, status = row.split(",")
        assert (int(frame), status) == (estimate.frame, estimate.status) and float(ms) > 0
        expected = [*(box if estimate.frame == 3 else estimate.box), estimate.score]
        assert [float(number) for number in numbers] == pytest.approx(expected, abs=1e-6)
    summary = json.loads((tables / "clip1.json").read_text())
    counts = [summary[f"frames_{status}"] for status in ("tracked", "uncertain", "lost")]
    assert (summary["frames"], sum(counts), summary["seed"]) == (24, 24, 1)
    assert summary["tracking_fps"] > 0 and isinstance(summary["losses"], list)


def test_each_clip_has_a_video(tmp_path: Path, clips: list[Clip], frames: Path, box: Any) -> None:
    """It is that of `patchlock track --video`; of a clip that was complete before, it is made too."""
    part = Clip(frames, box, name="part", start=3, end=12, stride=2)
    videos, settings = tmp_path / "videos", tmp_path / "quick.toml"
    settings.write_text("[paper]\nparticles = 60\n[paper.patches]\nsmall_step = 4\n")
    run([part], tmp_path / "out", jobs=1, progress=False, config=QUICK)
    wrong = Clip(tmp_path / "no such folder", box, name="wrong")
    summary = run([clips[1], part, wrong], tmp_path / "out", progress=False, config=QUICK, videos=videos)
    assert (summary.done, summary.kept, len(summary.failed)) == (2, 0, 1)
    assert sorted(path.name for path in videos.iterdir()) == ["clip1.mp4", "part.mp4"]
    words = ["track", frames, "--box", ",".join(map(str, box)), "--start", 3, "--end", 12, "--stride", 2]
    words += ["--preset", "paper", "--config", settings, "--video", tmp_path / "track.mp4", "--quiet"]
    subprocess.run([sys.executable, "-m", "patchlock", *map(str, words)], check=True)
    assert (videos / "part.mp4").read_bytes() == (tmp_path / "track.mp4").read_bytes()
    summary = run([clips[1], part], tmp_path / "out", progress=False, config=QUICK, videos=videos)
    assert (summary.done, summary.kept) == (0, 2)
    summary = run([part], tmp_path / "other", progress=False, config=QUICK, videos=frames / "0000.png")
    assert "cannot write" in summary.failed[0].message and not boxes_below(tmp_path / "other")


def test_losses_have_the_frames_of_the_loss_and_of_the_return() -> None:
    statuses = ["tracked", "lost", "lost", "uncertain", "lost"]
    assert _losses([0, 2, 4, 6, 8], statuses) == [
        {"lost_frame": 2, "return_frame": 6},
        {"lost_frame": 8, "return_frame": None},
    ]


def test_the_boxes_are_those_of_track(tmp_path: Path, clips: list[Clip], frames: Path, box: Any) -> None:
    part = Clip(frames, box, name="part", start=0, end=9, stride=2)
    summary = run([*clips[:2], part], tmp_path, jobs=2, name="robust", progress=False, config=QUICK)
    assert (summary.done, summary.kept, summary.failed, summary.left) == (3, 0, [], 0)
    assert summary.frames == 24 + 24 + 5 and summary.fps > 0
    for name, seed, choice in (("clip1", 1, {}), ("part", 0, {"end": 9, "stride": 2})):
        lines = (tmp_path / "robust" / "ope" / name / f"{seed}.txt").read_text().splitlines()
        settings = quick()
        settings.seed = seed
        got = [[float(word) for word in line.split(",")] for line in lines]
        estimates = list(patchlock.track(frames, box, config=settings, progress=False, **choice))
        # The first line is the given box.
        boxes = [box, *(estimate.box for estimate in estimates[1:])]
        assert got == [[x + 1, y + 1, w, h] for x, y, w, h in boxes]
    assert json.loads((tmp_path / "batch.json").read_text()) == summary.to_dict()
    manifest = json.loads((tmp_path / "robust" / "ope" / "part" / "0.json").read_text())
    assert manifest["clip"] == {"source": str(frames), "start": 0, "end": 9, "stride": 2}
    assert (manifest["jobs"], manifest["threads"]) == (2, 1)


def test_complete_runs_are_kept_and_damaged_ones_repeated(tmp_path: Path, clips: list[Clip]) -> None:
    run(clips[:3], tmp_path, name="robust", progress=False, config=QUICK)
    whole = boxes_below(tmp_path)
    (tmp_path / "robust/ope/clip0/0.json").unlink()
    (tmp_path / "robust/ope/clip1/1.txt").write_text("1,2,3,4\n")
    summary = run(clips[:3], tmp_path, name="robust", progress=False, config=QUICK)
    assert (summary.done, summary.kept) == (2, 1)
    assert boxes_below(tmp_path) == whole
    with pytest.raises(ValueError, match="particles is 60 there and 61 here"):
        run(clips[:1], tmp_path, name="robust", progress=False, config=quick(61))
    other = Clip(clips[0].source, clips[0].box, name="clip0", seed=0, end=5)
    [failure] = run([other], tmp_path, name="robust", progress=False, config=QUICK).failed
    assert failure.name == "clip0" and "already holds different runs" in failure.message


def test_clips_with_own_settings_have_own_folders(tmp_path: Path, clips: list[Clip]) -> None:
    own = Clip(clips[1].source, clips[1].box, name="own", settings={"particles": 20})
    same = Clip(clips[1].source, clips[1].box, name="same", settings={"particles": 60, "seed": 5})
    strange = Clip(clips[1].source, clips[1].box, name="strange", settings={"partcles": 20})
    summary = run([clips[0], own, same, strange], tmp_path, name="robust", progress=False, config=QUICK)
    folders = [Path(folder).name for folder in summary.folders]
    assert folders[0] == "robust" and len(folders) == 2 and folders[1].startswith("robust-")
    assert set(boxes_below(tmp_path)) == {
        f"{folders[1]}/ope/own/0.txt",
        "robust/ope/clip0/0.txt",
        "robust/ope/same/5.txt",
    }
    [failure] = summary.failed
    assert failure.name == "strange" and "did you mean particles" in failure.message


def test_common_settings_are_part_of_the_name(tmp_path: Path, clips: list[Clip]) -> None:
    def folder(**given: Any) -> str:
        summary = run(clips[:1], tmp_path, progress=False, **given)
        assert summary.failed == []
        return Path(summary.folders[0]).name

    name = folder(config=QUICK)
    assert name.startswith("paper-") and len(name) == len("paper-") + 8
    # A bench with the preset's own settings does not collide with it.
    assert not (tmp_path / "paper").exists()
    assert folder(config=quick(50)) not in (name, "paper")
    assert folder(config=QUICK, name="mine") == "mine"
    other_seed = quick()
    other_seed.seed = 4
    assert folder(config=other_seed) == name


def test_failed_clips_do_not_stop_the_others(tmp_path: Path, clips: list[Clip], box: Any) -> None:
    broken = tmp_path / "broken"
    broken.mkdir()
    for k in range(3):
        (broken / f"{k}.png").write_bytes(
            (Path(clips[0].source) / f"{k:04d}.png").read_bytes()[: 900 if k == 2 else None]
        )
    rows = [
        f"{clips[0].source},1 2 3,short",
        f"{clips[0].source},5000 5 20 20,outside",
        f"nowhere.mp4,{' '.join(map(str, box))},missing",
        f"broken,{' '.join(map(str, box))},broken",
        f"{clips[0].source},{' '.join(map(str, box))},good",
    ]
    manifest = tmp_path / "clips.csv"
    manifest.write_text("source,box,name\n" + "\n".join(rows) + "\n")
    config = tmp_path / "quick.toml"
    config.write_text("[paper]\nparticles = 60\n[paper.patches]\nsmall_step = 4\n")
    command = [
        sys.executable,
        "-m",
        "patchlock.batch",
        str(manifest),
        "--out",
        str(tmp_path / "out"),
        "--config",
        str(config),
    ]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 1, ended.stderr
    assert "1 done, 0 already done, 4 failed" in ended.stdout
    assert list(boxes_below(tmp_path / "out")) == ["quick/ope/good/0.txt"]
    failed = {
        failure["name"]: failure["message"]
        for failure in json.loads((tmp_path / "out/batch.json").read_text())["failed"]
    }
    assert "not four numbers" in failed["short"] and "line 2" in failed["short"]
    assert "no part of the box is in it" in failed["outside"]
    assert "no file or folder" in failed["missing"]
    assert "cannot read frame 2" in failed["broken"]


def test_a_process_that_is_killed_is_replaced(tmp_path: Path, clips: list[Clip]) -> None:
    run(clips, tmp_path / "whole", name="robust", progress=False, config=QUICK)
    with Local(jobs=2) as engine:
        killed = []

        def kill() -> None:
            for finished in (1, 5):
                until(lambda n=finished: len(boxes_below(tmp_path / "out")) >= n)
                worker = next(w for w in engine._workers if w.key is not None)
                killed.append(worker.process.pid)
                os.kill(worker.process.pid, signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        summary = run(clips, tmp_path / "out", engine=engine, name="robust", progress=False, config=QUICK)
        killer.join()
    assert len(set(killed)) == 2
    assert (summary.done, summary.failed) == (12, [])
    assert boxes_below(tmp_path / "out") == boxes_below(tmp_path / "whole")
    assert manifests_below(tmp_path / "out") == manifests_below(tmp_path / "whole")


class LosingEngine:
    """An engine that loses the first `losses` runs."""

    slots = room = threads = 1

    def __init__(self, losses: int) -> None:
        self.losses, self.keys = losses, list[int]()

    def __enter__(self) -> LosingEngine:
        return self

    def __exit__(self, *_: object) -> None: ...

    def submit(self, key: int, job: str) -> None:
        self.keys.append(key)

    def wait(self) -> list[tuple[int, Outcome]]:
        self.losses -= 1
        return [(self.keys[-1], Lost("gone") if self.losses >= 0 else Made("", ""))]


@pytest.mark.parametrize(("losses", "tries"), [(0, 1), (2, 3), (9, 3)])
def test_a_lost_run_is_retried_a_limited_number_of_times(losses: int, tries: int) -> None:
    engine = LosingEngine(losses)
    task = Task("a", "seed 0", "{}", None)  # type: ignore[arg-type]
    [(same, outcome)] = drive(engine, [task], retries=2)
    assert same is task and len(engine.keys) == tries
    assert outcome == (Made("", "") if losses < 3 else Failed("gone; it was tried 3 times"))


def listen_to_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def children(pid: int) -> list[int]:
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="processes are looked up in /proc")
@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGINT])
def test_an_interrupted_batch_can_be_continued(
    tmp_path: Path, clips: list[Clip], ending: signal.Signals
) -> None:
    manifest = write_manifest(tmp_path, clips)
    command = [sys.executable, "-m", "patchlock.batch", str(manifest)]
    command += ["--preset", "paper", "--jobs", "2", "--out"]
    subprocess.run([*command, str(tmp_path / "whole")], check=True, capture_output=True)
    out = tmp_path / "out"
    # A shell starts background jobs with SIGINT ignored, and child processes inherit that.
    process = subprocess.Popen(
        [*command, str(out)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=listen_to_interrupts,
    )
    until(lambda: len(list(out.rglob("ope/*/*.json"))) >= 3)
    workers = children(process.pid)
    assert len(workers) == 2
    process.send_signal(ending)
    _, said = process.communicate()
    until(
        lambda: (
            not any(
                Path(f"/proc/{pid}/cmdline").exists() and Path(f"/proc/{pid}/cmdline").read_bytes()
                for pid in workers
            )
        ),
        10,
    )
    if ending == signal.SIGINT:
        assert process.returncode == 130 and "repeat the command to continue" in said
        summary = json.loads((out / "batch.json").read_text())
        assert summary["left"] == 12 - summary["done"] > 0
    ended = subprocess.run([*command, str(out), "--json"], check=True, capture_output=True, text=True)
    summary = json.loads(ended.stdout)
    assert summary["done"] + summary["kept"] == 12 and summary["kept"] >= 3
    assert boxes_below(out) == boxes_below(tmp_path / "whole")
    assert manifests_below(out) == manifests_below(tmp_path / "whole")
    assert not [path for path in leftovers(out) if ending == signal.SIGINT]


def test_truth_is_missed_before_anything_runs(tmp_path: Path, frames: Path) -> None:
    (tmp_path / "clips.csv").write_text(f"source,x,y,w,h\n{frames},10,10,30,30\n")
    command = [sys.executable, "-m", "patchlock.batch", "clips.csv", "--out", "out", "--truth-to", "truth"]
    ran = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 2 and "no clip of clips.csv has truth" in ran.stderr, ran.stderr
    assert [path.name for path in tmp_path.iterdir() if path != frames] == ["clips.csv"]


def test_score_and_report_read_the_results_and_the_collected_truth(
    tmp_path: Path, frames: Path, scene: patchlock.Scene
) -> None:
    truth = [scene.truth(k) for k in range(24)]
    (tmp_path / "truth.txt").write_text("".join(f"{x + 1},{y + 1},{w},{h}\n" for x, y, w, h in truth))
    (tmp_path / "clips.csv").write_text(
        "source,truth,name,stride,settings\n"
        f"{frames},truth.txt,a,,small_step=8\n"
        f"{frames},truth.txt,b,2,small_step=8\n"
    )
    python = [sys.executable, "-m"]
    out, gathered = str(tmp_path / "out"), str(tmp_path / "truth")
    made = [*python, "patchlock.batch", str(tmp_path / "clips.csv"), "--out", out, "--truth-to", gathered]
    subprocess.run(made, check=True, capture_output=True)
    score = subprocess.run(
        [*python, "patchlock", "score", out, "--truth", gathered, "--json"],
        check=True,
        capture_output=True,
        text=True,
    )
    [tracker] = json.loads(score.stdout)["trackers"]
    assert tracker["targets"] == 2 and tracker["dp20"] > 0.9
    page = tmp_path / "page.html"
    subprocess.run(
        [*python, "patchlock", "report", out, "--truth", gathered, "--out", str(page)],
        check=True,
        capture_output=True,
    )
    assert "<svg" in page.read_text()


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ({"engine": "slurm"}, "no engine 'slurm'"),
        ({"address": "10.0.0.1"}, "only the engine"),
        ({"jobs": 0}, "jobs is 0"),
        ({"threads": 0}, "threads is 0"),
        ({"retries": -1}, "retries is -1"),
        ({"name": "a/b"}, "name of a folder"),
        ({"preset": "papr"}, "unknown preset `papr`"),
        ({"config": TOO_LARGE}, "large_patch"),
    ],
)
def test_invalid_arguments_are_refused(
    tmp_path: Path, clips: list[Clip], choice: dict[str, Any], said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        run(clips[:1], tmp_path, progress=False, **choice)
    assert not boxes_below(tmp_path)


def test_a_network_is_loaded_from_its_path(tmp_path: Path, clips: list[Clip], film: Any, box: Any) -> None:
    """By the workers; the pixels of the clips are those of the film."""
    model = nanotrack_in(tmp_path / "model")
    summary = run(clips[:2], tmp_path / "out", preset="network", model=model, progress=False)
    assert (summary.done, summary.failed) == (2, [])
    [folder] = summary.folders
    assert Path(folder).name.startswith("network-"), "networks have folders of their own"
    manifest = json.loads((Path(folder) / "ope/clip1/1.json").read_text())
    network = patchlock.Network(model)
    assert manifest["subject"]["network"] == {
        "model": network.name,
        "model_sha256": network.hash,
        "runtime": "built-in",
    }
    tracked = list(patchlock.track(film, box, preset="network", model=network))
    lines = (Path(folder) / "ope/clip1/1.txt").read_text().splitlines()[1 : len(tracked)]
    got = [[float(word) for word in line.split(",")] for line in lines]
    assert got == [[x + 1, y + 1, w, h] for x, y, w, h in (e.box for e in tracked[1:])]
    with pytest.raises(ValueError, match="model must be one folder or file"):
        run(clips[:1], tmp_path / "out", preset="network", model=NANOTRACK, progress=False)
    with pytest.raises(ValueError, match="needs a network"):
        run(clips[:1], tmp_path / "out", preset="network", model="none", progress=False)


def test_the_command_takes_a_network(tmp_path: Path, clips: list[Clip]) -> None:
    manifest = tmp_path / "clips.jsonl"
    rows = [{"source": str(c.source), "box": c.box, "name": c.name} for c in clips[:1]]
    manifest.write_text("".join(json.dumps(row) + "\n" for row in rows))
    words = ["--out", str(tmp_path / "out"), "--preset", "network", "--model", str(VITTRACK), "--json"]
    command = [sys.executable, "-m", "patchlock.batch", str(manifest), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["done"] == 1
