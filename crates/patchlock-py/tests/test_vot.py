"""Runs Patchlock in the VOT toolkit: test, supervised and unsupervised experiments, analysis, report."""

from __future__ import annotations

import configparser
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import made_up
import pytest
from networks import VITTRACK

from patchlock.toolkits import vot as ours

FRAMES = 24


def test_the_file_has_the_command() -> None:
    words = ours.command(preset="paper", seed=3, threads=2, protocol=3)
    file = configparser.ConfigParser()
    file.read_string(ours.registry([*words, "100% of 'it'"], name="a-b", label="Patch 5%"))
    assert file["a-b"]["protocol"] == "trax" and file["a-b"]["label"] == "Patch 5%"
    expected = [sys.executable, "-m", "patchlock", "trax", "--protocol", "3", "--preset", "paper"]
    expected += ["--seed", "3", "--threads", "2", "100% of 'it'"]
    assert shlex.split(file["a-b"]["command"]) == expected


def test_the_command_has_the_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(VITTRACK.parent)
    monkeypatch.setattr(ours, "library", lambda: VITTRACK.with_name("network.json"))
    words = ours.command(preset="network", model=VITTRACK.name, runtime="onnxruntime")
    expected = ["--model", str(VITTRACK), "--runtime", str(VITTRACK.with_name("network.json"))]
    assert words[-4:] == expected
    assert ours.command(preset="network", model="patchnet")[-2:] == ["--model", "patchnet"]
    with pytest.raises(FileNotFoundError, match="model is none.onnx"):
        ours.command(preset="network", model="none.onnx")


def test_a_wrong_name_or_file_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match="allowed: letters"):
        ours.registry(["x"], name="a b")
    with pytest.raises(FileNotFoundError):
        ours.command(config="/no/such.toml")
    with pytest.raises(SystemExit):
        ours.main(["--config", "/no/such.toml"])
    assert "/no/such.toml" in capsys.readouterr().err


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with Patchlock and three sequences.

    The truth consists of boxes in the first and of polygons in the second. In the third the target jumps so
    far that the tracker loses it.
    """
    folder = tmp_path_factory.mktemp("vot")
    (folder / "quick.toml").write_text(made_up.SETTINGS)
    options = ["--config", str(folder / "quick.toml"), "--threads", "1"]
    module = [sys.executable, "-m", "patchlock.toolkits.vot", *options]
    (folder / "trackers.ini").write_text(subprocess.check_output(module, text=True))
    (folder / "config.yaml").write_text(made_up.snippet("yaml", "registry"))
    (folder / "stack.yaml").write_text(made_up.snippet("yaml", "experiments"))
    for name in ["boxes", "polygons", "jump"]:
        sequence = folder / "sequences" / name
        made_up.save_frames(sequence / "color", FRAMES, "%08d.jpg", jump=name == "jump")
        (sequence / "sequence").write_text(made_up.snippet("ini", "channels").replace("boxes", name))
        lines = (region(k, name) for k in range(FRAMES))
        (sequence / "groundtruth.txt").write_text("".join(f"{line}\n" for line in lines))
    (folder / "sequences" / "list.txt").write_text("boxes\npolygons\njump\n")
    return folder


def region(k: int, name: str) -> str:
    """The truth of a frame, in the toolkit's file format."""
    x, y, w, h = made_up.box(k, name == "jump" and made_up.jumps(k, FRAMES))
    corners = (x, y, x + w, y, x + w, y + h, x, y + h)
    return ",".join(str(value) for value in (corners if name == "polygons" else (x, y, w, h)))


def vot(workspace: Path, *arguments: str) -> str:
    """Runs the toolkit's own command, which must succeed.

    The proxy keeps it from looking for a newer version on the network.
    """
    environment = {**os.environ, "https_proxy": "http://127.0.0.1:9", "MPLBACKEND": "Agg"}
    words = [sys.executable, "-m", "vot", *arguments]
    done = subprocess.run(words, cwd=workspace, env=environment, capture_output=True, text=True, timeout=300)
    text = done.stdout + done.stderr
    assert done.returncode == 0, text
    return text


def test_the_toolkit_tests_it(workspace: Path) -> None:
    made_up.toolkit("vot")
    said = vot(workspace, "test", "patchlock", "--sequence", "sequences/polygons")
    assert "Test concluded successfuly" in said, said
    assert f"Processing frame {FRAMES - 1}/{FRAMES - 1}" in said
    states = [line for line in said.splitlines() if "@@TRAX:state" in line]
    assert len(states) == FRAMES and all("confidence=" in state for state in states)


@pytest.mark.slow(40)
def test_experiments_analysis_and_report(workspace: Path) -> None:
    made_up.toolkit("vot")
    assert "Evaluation concluded successfuly" in vot(workspace, "evaluate", "patchlock")
    results = workspace / "results" / "patchlock"
    for experiment, runs in [("baseline", 3), ("unsupervised", 1)]:
        for sequence in ["boxes", "polygons", "jump"]:
            confidence = sorted((results / experiment / sequence).glob("*_confidence.value"))
            assert len(confidence) == runs, "the toolkit stops after three identical repetitions"
            values = [float(line) for line in confidence[0].read_text().split()]
            assert values and all(0 <= value <= 1 for value in values)

    vot(workspace, "analysis", "patchlock", "--format", "json", "--name", "scores")
    analysis = json.loads((workspace / "analysis" / "scores.json").read_text())["results"]
    accuracy, robustness, *_ = analysis["baseline"]["results"][0][0]
    assert accuracy > 0.8
    assert 0 < robustness < 1, "one of three sequences fails once and is restarted"
    (unsupervised,) = analysis["unsupervised"]["results"][0][0]
    assert 0.5 < unsupervised < accuracy, "without a restart the target stays lost after the jump"

    vot(workspace, "report", "patchlock", "--name", "page")
    assert "Patchlock" in (workspace / "reports" / "page" / "report.html").read_text()
