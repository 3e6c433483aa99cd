"""Tests of the preset network: where a network comes from, tracking, pickling, runtimes."""

from __future__ import annotations

import copy
import pickle
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from networks import NANOTRACK, VITTRACK, nanotrack_in, need_onnxruntime, outside
from PIL import Image

import patchlock
from patchlock import Config, ModelFile, MultiTracker, Network, Tracker, _onnxruntime

BOX = (70, 60, 40, 30)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of one network."""
    return nanotrack_in(tmp_path_factory.mktemp("models") / "nanotrack")


@pytest.fixture(scope="module")
def network(folder: Path) -> Network:
    return Network(folder)


def boxes(tracker: Tracker, film: list[Any]) -> list[patchlock.Box]:
    return [tracker.estimate.box, *(tracker.update(frame).box for frame in film[1:])]


# ---- where a network comes from


def test_a_network_is_made_from_a_folder_files_or_bytes(folder, network):
    content = [file.read_bytes() for file in NANOTRACK]
    assert (network.name[:9], network.runtime, network.paths) == ("NanoTrack", "built-in", [folder])
    assert len(network.hash) == 64 and network.hash[:8] in repr(network)
    for files in (str(folder), NANOTRACK, [str(file) for file in NANOTRACK], NANOTRACK[::-1], content):
        again = Network(files)
        assert again == network and hash(again) == hash(network)
    assert Network(content).paths == []
    single = Network(VITTRACK)
    assert single == Network(VITTRACK.read_bytes()) == Network([VITTRACK])
    assert single != network and single.name == "VitTrack"


def test_paths_are_kept_in_full(folder, network, monkeypatch):
    monkeypatch.chdir(folder.parent)
    assert Network(folder.name).paths == [folder]


def test_a_file_says_what_it_is():
    head = ModelFile(NANOTRACK[1])
    assert (head.family, head.part, len(head.sha256)) == ("NanoTrack", "head", 64)
    assert head.operators > 0 and head.parameters > 0 and head.values
    # It is not one that somebody published.
    assert (head.name, head.origin, head.licence, head.training) == (None, None, None, None)
    assert ModelFile(NANOTRACK[1].read_bytes()).sha256 == head.sha256
    assert "NanoTrack head" in repr(head)


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda folder: Network(folder.parent), ValueError, r"no file \*\.onnx"),
        (lambda folder: Network(NANOTRACK[1]), ValueError, "the backbone is missing"),
        (lambda folder: Network([*NANOTRACK, VITTRACK]), ValueError, "the files are"),
        (lambda folder: Network(b"none"), ValueError, "not an ONNX file"),
        (lambda folder: Network([]), ValueError, "empty list"),
        (lambda folder: Network([NANOTRACK[0], b"none"]), TypeError, "one kind"),
        (lambda folder: Network(5), TypeError, "model is a path, .*not int"),
        (lambda folder: Network(folder, runtime=5), TypeError, 'None, "onnxruntime" or .*not int'),
        (lambda folder: Network(folder / "none.onnx"), OSError, "none.onnx"),
        (lambda folder: Network(folder, runtime=folder / "none.so"), ValueError, "none.so.*runtime= takes"),
        (lambda folder: ModelFile(folder / "none.onnx"), OSError, "none.onnx"),
        (lambda folder: ModelFile(b"none"), ValueError, "not an ONNX file"),
    ],
)
def test_files_that_are_no_network_are_refused(folder, make, error, says):
    with pytest.raises(error, match=says):
        make(folder)


# ---- settings


def test_settings_hold_the_network(folder, network):
    config = Config("network", model=folder)
    assert config.model == network and config.model is config.model
    assert config.network.tracked_score > config.network.lost_score > 0
    assert list(config.to_dict()["network"]) == ["tracked_score", "lost_score"]
    assert Config("network", model=network).model is network
    assert Config("network").model is Config().model and Config().model == Network("patchnet")
    assert Config("paper").model is None and Config(model="none").model is None
    assert config != Config("network") and config == Config("network", model=NANOTRACK)
    # Also where every setting differs from the preset.
    config.seed, config.network.tracked_score, config.network.lost_score = 1, 0.7, 0.2
    assert repr(config).startswith("<Config 'network', seed=1, ") and network.name in repr(config)
    for again in (copy.copy, copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c))):
        assert again(config) == config and again(config).model == network
    assert "model" in dir(config) and "network" in dir(config) and "robust" not in dir(config)


def test_a_settings_file_names_a_network_beside_it(folder, network):
    file = folder.parent / "my.toml"
    file.write_text('model = "nanotrack"\n[network]\nlost_score = 0.3\n')
    config = Config("robust", file)
    assert config.model == network and config.network.lost_score == 0.3
    assert config.model.paths == [folder]
    assert Config("robust", file, model=VITTRACK).model == Network(VITTRACK)
    other = Network(VITTRACK.read_bytes())
    assert Config("robust", file, model=other).model is other


@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda folder: Config("paper", model=folder), ValueError, "no effect with the method paper"),
        (lambda folder: Config("paper", runtime="x.so"), ValueError, "runs a network, but there is none"),
        (lambda folder: Config(model="none", runtime="x.so"), ValueError, "runs a network, but there is none"),
        (lambda folder: Config("network", model=Network(folder), runtime="x.so"), ValueError, "has its runtime"),
        (lambda folder: setattr(Config("network"), "model", folder), AttributeError, "can't be changed"),
        (lambda folder: Config("network").network.patches, AttributeError, "no setting 'patches'"),
        (lambda folder: Config("network").templates, AttributeError, r'Config\("robust"\)'),
        (lambda folder: Config().network, AttributeError, r'Config\("network"\)'),
    ],
)
def test_settings_that_do_not_go_with_a_network_are_refused(folder, make, error, says):
    with pytest.raises(error, match=says):
        make(folder)


# ---- tracking


@pytest.mark.parametrize("files", [NANOTRACK, VITTRACK])
def test_every_way_to_name_the_network_gives_the_same_boxes(film, files):
    network = Network(files)
    found = boxes(Tracker(film[0], BOX, preset="network", model=files), film)
    assert len({box.x for box in found}) > 1
    for tracker in (
        Tracker(film[0], BOX, preset="network", model=network, threads=2),
        Tracker(film[0], BOX, Config("network", model=network), threads=1),
        Tracker(film[0], BOX, Config("network"), model=files),
    ):
        assert boxes(tracker, film) == found
        assert tracker.config.model == network
    estimates = list(patchlock.track(film, BOX, preset="network", model=network))
    assert [estimate.box for estimate in estimates] == found
    many = MultiTracker(preset="network", model=network)
    for _ in range(2):
        many.add(film[0], BOX)
    for k, frame in enumerate(film[1:], 1):
        assert [estimate.box for estimate in many.update(frame).values()] == [found[k]] * 2


def test_a_tracker_needs_a_network(film, folder):
    for make in (
        lambda: Tracker(film[0], BOX, preset="network", model="none"),
        lambda: MultiTracker(preset="network", model="none"),
        lambda: patchlock.track(film, BOX, preset="network", model="none"),
    ):
        with pytest.raises(ValueError, match=r"needs a network.*give its files with model="):
            make()
    with pytest.raises(ValueError, match="config and preset are both given"):
        Tracker(film[0], BOX, Config("network"), preset="network", model=folder)
    with pytest.raises(ValueError, match="no effect with the method paper"):
        Tracker(film[0], BOX, preset="paper", model=folder)


def test_an_estimate_has_no_visibility_and_can_be_drawn(film, network):
    tracker = Tracker(film[0], BOX, preset="network", model=network)
    for frame in film[1:4]:
        estimate = tracker.update(frame)
        assert estimate.visibility is None and estimate.to_dict()["visible_small"] is None
        assert 0 <= estimate.score <= 1
        assert estimate.status in ("tracked", "uncertain", "lost")
        assert pickle.loads(pickle.dumps(estimate)) == estimate
        drawn = estimate.draw(frame)
        assert drawn.shape == frame.shape and not np.array_equal(drawn, frame)


def test_what_each_member_of_a_committee_said_can_be_observed(film, network):
    tracker, plain = (Tracker(film[0], BOX, model=network) for _ in range(2))
    alone = Tracker(film[0], BOX, model="none")
    for frame in film[1:]:
        estimate, seen = tracker.update_observed(frame)
        assert estimate == plain.update(frame)
        assert isinstance(seen, patchlock.CommitteeObservation)
        assert list(seen.estimates) == list(seen.observations) == list(seen.judgements) == ["filters", "network"]
        own = alone.update(frame)
        assert (seen.estimates["filters"].box, seen.estimates["filters"].score) == (own.box, own.score)
        assert isinstance(seen.observations["network"], patchlock.NetworkObservation)
        assert seen.agrees == (seen.believed == ["filters", "network"])
        assert (seen.judgements["filters"] is None) == seen.agrees
        assert seen.judgements["network"] is None and repr(seen)
        if not seen.agrees:
            [believed] = seen.believed
            assert estimate.box == pytest.approx(seen.estimates[believed].box)
            assert estimate.status != "tracked" or estimate.score >= 0.9


def test_what_the_network_saw_can_be_observed(film, network):
    tracker, plain = (Tracker(film[0], BOX, preset="network", model=network) for _ in range(2))
    scores = {}
    for frame in film[1:]:
        estimate, seen = tracker.update_observed(frame)
        assert estimate == plain.update(frame)
        assert isinstance(seen, patchlock.NetworkObservation)
        cells = seen.scores.shape[0]
        assert seen.scores.shape == seen.logits.shape == (cells, cells) and cells > 1
        row, column = seen.chosen
        assert 0 <= row < cells and 0 <= column < cells
        scores[seen.scores[seen.chosen]] = estimate.score
        assert seen.scores == pytest.approx(1 / (1 + np.exp(-seen.logits)))
        assert len(seen.seen) == 4 and repr(seen)
    assert [scores[score] for score in sorted(scores)] == sorted(scores.values())


# ---- snapshots, copies and pickles


def test_a_snapshot_needs_its_network(film, network):
    tracker = Tracker(film[0], BOX, preset="network", model=network)
    tracker.update(film[1])
    snapshot = tracker.snapshot()
    expected = tracker.update(film[2])
    restored = Tracker.restore(snapshot, model=network, frame=1)
    assert restored.update(film[2]) == expected and restored.config.model is network
    assert Tracker.restore(snapshot, model=NANOTRACK, frame=1).update(film[2]) == expected
    with pytest.raises(ValueError, match=f"{network.hash}; given: none.*model="):
        Tracker.restore(snapshot)
    with pytest.raises(ValueError, match=f"{network.hash}; given: "):
        Tracker.restore(snapshot, model=VITTRACK)
    many = MultiTracker(preset="network", model=network)
    many.add(film[0], BOX)
    again = MultiTracker.restore(many.snapshot(), model=network)
    assert again.update(film[1]) == many.update(film[1])
    with pytest.raises(ValueError, match="was tracked without a network"):
        Tracker.restore(Tracker(film[0], BOX, model="none").snapshot(), model=network)


@pytest.mark.parametrize(("model", "name"), [(None, "PatchNet"), ("patchnet", "PatchNet"), ("none", None)])
def test_our_own_network_is_the_default(film, model, name):
    for preset in ("robust", "network") if name else ("robust",):
        tracker = Tracker(film[0], BOX, preset=preset, model=model)
        many = MultiTracker(Config(preset, model=model))
        many.add(film[0], BOX)
        restored, again = Tracker.restore(tracker.snapshot()), MultiTracker.restore(many.snapshot())
        expected = tracker.update(film[1])
        assert restored.update(film[1]).box == expected.box
        for estimates in (many.update(film[1]), again.update(film[1])):
            assert [estimate.box for estimate in estimates.values()] == [expected.box]
        for one in (tracker, many, restored, again, pickle.loads(pickle.dumps(many))):
            assert (one.config.model and one.config.model.name) == name


@pytest.mark.parametrize("again", [lambda t: pickle.loads(pickle.dumps(t)), copy.deepcopy, copy.copy])
def test_a_copy_gives_the_same_boxes(film, network, again):
    tracker = Tracker(film[0], BOX, preset="network", model=network)
    many = MultiTracker(preset="network", model=network)
    many.add(film[0], BOX)
    for copied, original in ((again(tracker), tracker), (again(many), many)):
        assert copied.config == original.config and copied.config.model == network
        assert copied.update(film[1]) == original.update(film[1])


def test_a_pickle_names_the_files_and_shares_the_network(film, folder, network):
    trackers = [Tracker(film[0], BOX, preset="network", model=network) for _ in range(2)]
    pickled = pickle.dumps([network, *trackers])
    for file in folder.iterdir():
        assert file.read_bytes()[1000:1064] not in pickled
    again, *others = pickle.loads(pickled)
    assert again == network and again is not network
    assert all(tracker.config.model is again for tracker in others)


def test_a_pickle_needs_unchanged_files(film, tmp_path):
    folder = nanotrack_in(tmp_path / "model")
    tracker = Tracker(film[0], BOX, preset="network", model=folder)
    things = [pickle.dumps(thing) for thing in (tracker, tracker.config, tracker.config.model)]
    shutil.copy(VITTRACK, folder.with_name("vittrack.onnx"))
    shutil.rmtree(folder)
    for pickled in things:
        with pytest.raises(OSError, match="model"):
            pickle.loads(pickled)
    folder.with_name("vittrack.onnx").rename(folder)
    for pickled in things:
        with pytest.raises(ValueError, match="has changed since it was pickled"):
            pickle.loads(pickled)


def test_a_network_from_bytes_is_copied_but_not_pickled(film):
    network = Network(VITTRACK.read_bytes())
    tracker = Tracker(film[0], BOX, preset="network", model=network)
    for thing in (network, tracker, tracker.config):
        with pytest.raises(TypeError, match="made from bytes can't be pickled"):
            pickle.dumps(thing)
    assert copy.deepcopy(network) is network is copy.copy(network)
    assert copy.deepcopy(tracker).update(film[1]) == tracker.update(film[1])
    assert copy.deepcopy(tracker.config) == tracker.config


# ---- runtimes


def test_onnxruntime_gives_the_same_boxes(film, folder, network):
    need_onnxruntime()
    other = Network(folder, runtime="onnxruntime")
    assert (other.runtime, other) == ("onnxruntime", network)
    assert pickle.loads(pickle.dumps(other)).runtime == "onnxruntime"
    assert Network(folder, runtime=_onnxruntime.library()).runtime == "onnxruntime"
    ours, theirs = (boxes(Tracker(film[0], BOX, preset="network", model=one), film) for one in (network, other))
    assert np.array(ours) == pytest.approx(np.array(theirs), abs=0.5)


@pytest.mark.parametrize("name", ["libonnxruntime.so.1.32.0", "libonnxruntime.1.32.0.dylib", "onnxruntime.dll"])
def test_the_library_is_found_without_importing_its_package(tmp_path, monkeypatch, name):
    capi = tmp_path / "onnxruntime" / "capi"
    capi.mkdir(parents=True)
    (capi.parent / "__init__.py").write_text("raise RuntimeError")
    monkeypatch.syspath_prepend(str(tmp_path))
    with monkeypatch.context() as patched:
        patched.delitem(sys.modules, "onnxruntime", raising=False)
        for other in ("libonnxruntime_providers_shared.so", "onnxruntime_providers_shared.dll"):
            (capi / other).touch()
        with pytest.raises(ImportError, match="has no library"):
            _onnxruntime.library()
        (capi / name).touch()
        assert _onnxruntime.library() == capi / name


def test_a_missing_onnxruntime_is_named(folder, monkeypatch):
    monkeypatch.setattr(_onnxruntime, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r'pip install "patchlock\[onnxruntime\]"'):
        Network(folder, runtime="onnxruntime")


# ---- real networks


@pytest.mark.parametrize("name", ["nanotrack-v3", "nanotrack-v2", "vittrack"])
def test_the_files_of_published_networks_are_known(name):
    folder = outside("PATCHLOCK_MODELS", "models", name)
    for file in folder.glob("*.onnx"):
        known = ModelFile(file)
        assert known.licence == "Apache-2.0" and known.origin and known.training
        assert known.name == Network(folder).name


def test_both_runtimes_follow_a_real_target_alike():
    folder = outside("PATCHLOCK_MODELS", "models", "nanotrack-v3")
    sequence = outside("PATCHLOCK_DATA", "data", "otb-dev") / "CarScale"
    need_onnxruntime()
    truth = np.loadtxt(sequence / "groundtruth_rect.txt", delimiter=",")[:30]
    frames = [np.asarray(Image.open(file).convert("RGB")) for file in sorted(sequence.glob("img/*.jpg"))[:30]]
    start = truth[0] - [1, 1, 0, 0]
    ours, theirs = (
        np.array([e.box for e in patchlock.track(frames, start, preset="network", model=folder, runtime=name)])
        for name in (None, "onnxruntime")
    )
    assert np.abs(ours - theirs).max() < 0.5
    centres = ours[:, :2] + ours[:, 2:] / 2
    assert np.abs(centres - (truth[:, :2] - 1 + truth[:, 2:] / 2)).max() < 20
