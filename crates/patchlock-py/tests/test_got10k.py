"""Runs Patchlock in the OTB experiment of the got10k toolkit."""

from __future__ import annotations

from pathlib import Path

import made_up
import numpy as np
import pytest

import patchlock

FRAMES = 12
NAMES = ["Basketball", "Crossing"]


@pytest.fixture
def otb(tmp_path: Path) -> Path:
    """Two synthetic sequences with names that the toolkit knows."""
    for name in NAMES:
        made_up.save_frames(tmp_path / "OTB" / name / "img", FRAMES, "%04d.jpg")
        # The truth files of OTB count from 1.
        boxes = np.array([made_up.box(k) for k in range(FRAMES)]) + [1, 1, 0, 0]
        np.savetxt(tmp_path / "OTB" / name / "groundtruth_rect.txt", boxes, delimiter=",", fmt="%.17g")
    return tmp_path


def test_an_otb_experiment_from_end_to_end(otb: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made_up.toolkit("got10k")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    from got10k.datasets import OTB
    from got10k.experiments import ExperimentOTB

    from patchlock.toolkits.got10k import PatchlockTracker

    # The toolkit downloads sequences that have no folder and ignores empty folders.
    for name in OTB._OTB__version_dict[2013]:
        (otb / "OTB" / name).mkdir(exist_ok=True)
    experiment = ExperimentOTB(
        str(otb / "OTB"), version=2013, result_dir=str(otb / "results"), report_dir=str(otb / "reports")
    )
    tracker = PatchlockTracker(name="Quick", config=made_up.CONFIG)
    assert tracker.is_deterministic
    experiment.run(tracker)
    performance = experiment.report(["Quick"])["Quick"]

    assert sorted(performance["seq_wise"]) == NAMES
    assert performance["overall"]["success_score"] > 0.8, performance
    assert performance["overall"]["precision_score"] == 1.0
    assert performance["overall"]["speed_fps"] > 0
    files = [otb / "results" / "OTB2013" / "Quick" / f"{name}.txt" for name in NAMES]
    assert files[0].read_text() == files[1].read_text(), "the same seed gives the same boxes"
    assert (otb / "reports" / "OTB2013" / "Quick" / "performance.json").is_file()

    # The boxes are those of the tracker alone, counted from 1.
    from PIL import Image

    images = sorted((otb / "OTB" / "Crossing" / "img").iterdir())
    alone = patchlock.Tracker(Image.open(images[0]), made_up.box(0), made_up.CONFIG)
    boxes = [alone.update(Image.open(image)).box for image in images[1:]]
    expected = np.array([made_up.box(0), *boxes]) + [1, 1, 0, 0]
    np.testing.assert_allclose(np.loadtxt(files[1], delimiter=","), expected, atol=0.001)


def test_datasets_may_count_from_0() -> None:
    made_up.toolkit("got10k")
    from patchlock.toolkits.got10k import PatchlockTracker

    tracker = PatchlockTracker(origin=0, config=made_up.CONFIG)
    assert tracker.estimate is None
    tracker.init(made_up.frame(0), np.array(made_up.box(0)))
    from_0 = tracker.update(made_up.frame(1))
    assert from_0.shape == (4,) and tracker.estimate is not None
    from_1 = PatchlockTracker(config=made_up.CONFIG)
    from_1.init(made_up.frame(0), np.array(made_up.box(0)) + [1, 1, 0, 0])
    np.testing.assert_array_equal(from_1.update(made_up.frame(1)), from_0 + [1, 1, 0, 0])
