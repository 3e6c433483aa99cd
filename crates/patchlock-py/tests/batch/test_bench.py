"""A benchmark run by an engine, compared with `patchlock bench`."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from networks import VITTRACK

import patchlock
from patchlock.batch import bench

from .conftest import boxes_below, manifests_below


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory, frames: Path, scene: patchlock.Scene) -> Path:
    """Two targets in the OTB layout, and one whose images are missing."""
    root = tmp_path_factory.mktemp("data")
    lines = [f"{x + 1},{y + 1},{w},{h}" for x, y, w, h in (scene.truth(k) for k in range(8))]
    for name in ("A", "B", "C"):
        (root / name / "img").mkdir(parents=True)
        for k in range(8) if name != "C" else ():
            shutil.copy(frames / f"{k:04d}.png", root / name / "img" / f"{k + 1:04d}.png")
        (root / name / "groundtruth_rect.txt").write_text("\n".join(lines) + "\n")
    return root


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("settings") / "quick.toml"
    path.write_text("seed = 3\n[paper]\nparticles = 30\n[paper.patches]\nsmall_step = 8\n")
    return path


@pytest.mark.parametrize("choice", [{"seeds": 2}, {"protocol": "sre", "sequences": ["A"], "name": "other"}])
def test_results_are_those_of_the_command(
    tmp_path: Path, dataset: Path, quick: Path, choice: dict[str, Any]
) -> None:
    words = {name: ",".join(value) if isinstance(value, list) else value for name, value in choice.items()}
    arguments = [f"--{name}={value}" for name, value in words.items()]
    command = [
        sys.executable,
        "-m",
        "patchlock",
        "bench",
        dataset,
        "--out",
        tmp_path / "whole",
        "--config",
        quick,
        *arguments,
    ]
    subprocess.run(command, check=False, capture_output=True)
    summary = bench(dataset, tmp_path / "out", jobs=2, file=quick, progress=False, **choice)
    whole = boxes_below(tmp_path / "whole")
    assert summary.done == len(whole) == (4 if "seeds" in choice else 12)
    assert boxes_below(tmp_path / "out") == whole
    assert manifests_below(tmp_path / "out") == manifests_below(tmp_path / "whole")
    names = [failure.name for failure in summary.failed]
    assert names == ([] if "sequences" in choice else ["C"])
    again = bench(dataset, tmp_path / "out", jobs=2, file=quick, progress=False, **choice)
    assert (again.done, again.kept) == (0, len(whole))
    manifest = next(path for path in (tmp_path / "out").iterdir() if path.is_dir()) / "manifest.json"
    assert manifest.read_bytes() == (tmp_path / "whole" / manifest.relative_to(tmp_path / "out")).read_bytes()


def test_a_network_gives_the_results_of_the_command(tmp_path: Path, dataset: Path) -> None:
    options = ["--preset", "network", "--model", VITTRACK, "--sequences", "A"]
    command = [sys.executable, "-m", "patchlock", "bench", dataset, "--out", tmp_path / "whole", *options]
    subprocess.run(command, check=True, capture_output=True)
    choice: dict[str, Any] = {"preset": "network", "model": VITTRACK, "sequences": ["A"], "progress": False}
    summary = bench(dataset, tmp_path / "out", **choice)
    assert (summary.done, summary.failed) == (1, [])
    assert boxes_below(tmp_path / "out") == boxes_below(tmp_path / "whole")
    assert manifests_below(tmp_path / "out") == manifests_below(tmp_path / "whole")


def test_invalid_arguments_are_refused(tmp_path: Path, dataset: Path) -> None:
    with pytest.raises(ValueError, match="no target Z"):
        bench(dataset, tmp_path, sequences=["Z"], progress=False)
    with pytest.raises(ValueError, match="^sequences: "):
        bench(dataset, tmp_path, sequences=["Z"], progress=False)
    with pytest.raises(ValueError, match="^command 'x: "):
        bench(dataset, tmp_path, command="'x", name="x", progress=False)
    with pytest.raises(ValueError, match="name"):
        bench(dataset, tmp_path, command="python3 t.py", progress=False)
    with pytest.raises(ValueError, match="can't be combined with command"):
        bench(dataset, tmp_path, command="python3 t.py", name="x", model=VITTRACK, progress=False)
    with pytest.raises(ValueError, match="needs a network"):
        bench(dataset, tmp_path, preset="network", model="none", progress=False)
    with pytest.raises(OSError, match="nowhere"):
        bench(tmp_path / "nowhere", tmp_path, progress=False)
