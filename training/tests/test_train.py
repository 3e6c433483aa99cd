"""A run that is stopped ends as one that is not, and the files compute what the network does."""

import pickle

import numpy as np
import onnx
import pytest
import torch
from test_geometry import small_store

from training import export, judge, loss, start, store, train
from training.network import Tracker, multiply_adds
from training.train import Settings


@pytest.fixture
def work(tmp_path):
    (tmp_path / store.FILE).write_bytes(pickle.dumps(small_store()))
    return tmp_path


def test_a_stopped_run_ends_with_the_same_weights(work, monkeypatch):
    monkeypatch.setattr(train, "KEPT_EVERY", 2)
    monkeypatch.setattr(train, "EVERY", 2)
    whole, parts = work / "whole", work / "parts"
    train.train(work, whole, Settings(steps=5, batch=4), threads=1, workers=1)
    learn, calls = train.Training.learn, []

    def stopping(training, *batch):
        calls.append(training.step)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return learn(training, *batch)

    monkeypatch.setattr(train.Training, "learn", stopping)
    with pytest.raises(KeyboardInterrupt):
        train.train(work, parts, Settings(steps=5, batch=4), threads=1, workers=1)
    train.train(work, parts, Settings(steps=5, batch=4), threads=1, workers=2)
    assert calls == [0, 1, 2, 3, 2, 3, 4]
    ends = [torch.load(run / "step-000005.pt", weights_only=True) for run in (whole, parts)]
    assert all((a == b).all() for a, b in zip(*(end.values() for end in ends), strict=True))


def test_a_run_is_not_mixed_with_another(work):
    run = work / "run"
    train.train(work, run, Settings(steps=1, batch=2), threads=1, workers=1)
    with pytest.raises(ValueError, match="use another folder"):
        train.train(work, run, Settings(steps=1, batch=2, seed=2), threads=1, workers=1)


def trained_network():
    """A network whose batch norms are not at their first values."""
    torch.manual_seed(3)
    network = Tracker().train()
    for _ in range(2):
        network(torch.rand(4, 3, 64, 64) * 255, torch.rand(4, 3, 128, 128) * 255)
    return network.eval()


def test_the_files_compute_what_the_network_does(tmp_path):
    network = trained_network()
    files = export.export(network, tmp_path)
    rng = np.random.default_rng(1)
    template = rng.integers(0, 255, (64, 64, 3), dtype=np.uint8)
    picture = rng.integers(0, 255, (128, 128, 3), dtype=np.uint8)
    loaded = judge.Network(tmp_path)
    score, sides = loaded.look(loaded.features(template), picture)
    planes = [torch.from_numpy(p).permute(2, 0, 1)[None].float() for p in (template, picture)]
    with torch.no_grad():
        logits, distances = network(*planes)
    assert np.abs(score - torch.sigmoid(logits)[0, 0].numpy()).max() < 1e-4
    assert np.abs(sides / distances[0].numpy() - 1).max() < 1e-4
    assert sum(file.stat().st_size for file in files) < 450_000
    allowed = (
        "Add Cast Clip Constant Conv Div Exp MatMul Mul ReduceMean Relu Reshape Sigmoid Slice "
        "Sqrt Sub Transpose"
    ).split()
    for file in files:
        assert {node.op_type for node in onnx.load(file).graph.node} <= set(allowed)


def test_the_network_keeps_its_budget():
    network = Tracker().eval()
    count = multiply_adds(network, torch.zeros(1, 3, 64, 64), torch.zeros(1, 3, 128, 128))
    assert count < 60e6


def test_a_perfect_prediction_costs_least():
    boxes = torch.tensor([[40.0, 48.0, 72.0, 80.0], [0.0, 0.0, 0.0, 0.0]])
    distances, positive, inside = loss.targets(boxes)
    assert positive[0].sum() == 4 and inside[0].sum() == 16 and not positive[1].any()
    logits = torch.where(positive, 8.0, -8.0)[:, None]
    perfect, overlap = loss.loss(logits, distances.clamp(min=1e-3), boxes)
    assert overlap == pytest.approx(1, abs=1e-4)
    for worse in (-logits, logits * 0):
        assert loss.loss(worse, distances.clamp(min=1e-3), boxes)[0] > perfect
    wide = loss.loss(logits, distances.clamp(min=1e-3) * 1.5, boxes)[0]
    assert wide > perfect


def test_the_plain_loop_follows_a_network_that_sees(tmp_path):
    class Seeing:
        """Sees the target two cells to the right, twice as large."""

        def features(self, picture):
            return picture

        def look(self, template, picture):
            score = np.zeros((16, 16))
            score[8, 10] = 1.0
            return score, np.full((4, 16, 16), 32.0)

    frame = np.zeros((200, 300, 3), np.uint8)
    tracker = judge.Tracker(Seeing(), frame, np.array([100.0, 80, 32, 32]))
    x, y, w, h = tracker.update(frame)
    assert (x + w / 2, y + h / 2) == pytest.approx((116 + 20, 96 + 4))
    rate = np.exp(-judge.PENALTY) * judge.RATE
    assert (w, h) == pytest.approx((32 + 32 * rate,) * 2)


def test_exported_weights_can_be_trained_on(work):
    network, again = trained_network(), Tracker()
    export.export(network, work / "files")
    start.begin(again, work / "files", work, Settings(batch=4))
    inputs = [torch.rand(3, 3, side, side) * 255 for side in (64, 128)]
    with torch.no_grad():
        wanted, made = network(*inputs), again.eval()(*inputs)
    for a, b in zip(wanted, made, strict=True):
        assert torch.allclose(a, b, rtol=1e-3, atol=1e-3)
