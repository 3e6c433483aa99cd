"""Trains the network. A run that was stopped goes on where its last checkpoint was made, and ends
with the same weights as one that was not."""

import copy
import csv
import os
import sys
import time
from dataclasses import asdict, dataclass

import torch

from . import loss as losses
from . import start
from .batches import Batches
from .network import Tracker

CHECKPOINT = "checkpoint.pt"
LOG = "log.csv"
COLUMNS = ("step", "pairs", "loss", "strangers", "overlap", "rate")
EVERY = 100
KEPT_EVERY = 1000
WARM = 200
# The last part of the steps, in which the rate falls.
COOLING = 0.4


@dataclass(frozen=True)
class Settings:
    """What the weights depend on, besides the store."""

    seed: int = 1
    steps: int = 12000
    batch: int = 32
    rate: float = 2e-3


def rate_at(step, settings):
    """Rises, stays, and falls to nearly nothing. Up to where it falls it does not depend on the
    number of steps, so a run can be made longer until then."""
    left = (settings.steps - step) / (COOLING * settings.steps)
    return settings.rate * min(1, (step + 1) / WARM, max(0.01, left))


class Training:
    """Network, its slow mean, and the optimiser."""

    def __init__(self, settings):
        torch.manual_seed(settings.seed)
        self.settings, self.step = settings, 0
        self.network = Tracker().to(memory_format=torch.channels_last)
        self.mean = copy.deepcopy(self.network).eval()
        matrices = [p for p in self.network.parameters() if p.ndim > 1]
        others = [p for p in self.network.parameters() if p.ndim <= 1]
        self.optimiser = torch.optim.AdamW(
            [dict(params=matrices, weight_decay=0.02), dict(params=others, weight_decay=0)],
            lr=settings.rate,
        )

    def save(self, path):
        """Writes a checkpoint; a stop leaves the old one."""
        state = {
            "settings": asdict(self.settings),
            "step": self.step,
            "network": self.network.state_dict(),
            "mean": self.mean.state_dict(),
            "optimiser": self.optimiser.state_dict(),
        }
        part = path.with_suffix(".part")
        torch.save(state, part)
        os.replace(part, path)

    def restore(self, path):
        """Goes on from a checkpoint."""
        state = torch.load(path, weights_only=True)
        given = asdict(self.settings) | {"steps": 0}
        saved = state["settings"] | {"steps": 0}
        if given != saved:
            raise ValueError(f"{path} was made with {saved}, not with {given}; use another folder")
        self.step = state["step"]
        self.network.load_state_dict(state["network"])
        self.mean.load_state_dict(state["mean"])
        self.optimiser.load_state_dict(state["optimiser"])

    def learn(self, templates, windows, boxes):
        """One step. Returns the parts of the loss and the mean overlap."""
        for group in self.optimiser.param_groups:
            group["lr"] = rate_at(self.step, self.settings)
        templates, windows = (
            pixels.permute(0, 3, 1, 2).float().contiguous(memory_format=torch.channels_last)
            for pixels in (templates, windows)
        )
        network, half = self.network.train(), len(boxes) // 2
        features, seen = network.backbone(templates), network.backbone(windows)
        total, overlap = losses.loss(*network.head(features, seen), boxes)
        # Half of the windows again, each with the template of another pair.
        logits, _ = network.head(features.roll(1, 0)[:half], seen[:half])
        apart = losses.strangers(logits)
        self.optimiser.zero_grad(set_to_none=True)
        (total + apart).backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        self.optimiser.step()
        self.step += 1
        self.follow()
        return total.item(), apart.item(), overlap.item()

    @torch.no_grad()
    def follow(self):
        """Moves the slow mean, from which the weights are exported."""
        share = 1 - min(0.999, (1 + self.step) / (10 + self.step))
        for mean, now in zip(
            *(n.state_dict().values() for n in (self.mean, self.network)), strict=True
        ):
            if mean.dtype.is_floating_point:
                mean.lerp_(now, share)


def train(work, run, settings, threads, workers, begun_with=None):
    """Trains until the last step, from nothing or from the files of a folder."""
    torch.set_num_threads(threads)
    run.mkdir(parents=True, exist_ok=True)
    training = Training(settings)
    if (run / CHECKPOINT).exists():
        training.restore(run / CHECKPOINT)
    elif begun_with:
        start.begin(training.network, begun_with, work, settings)
        training.mean.load_state_dict(training.network.state_dict())
    batches = Batches(work, settings.seed, settings.batch, training.step, workers)
    begun, first, sums = time.monotonic(), training.step, [0.0] * 3
    try:
        while training.step < settings.steps:
            sums = [a + b for a, b in zip(sums, training.learn(*batches.take()), strict=True)]
            if training.step % EVERY == 0:
                speed = (training.step - first) * settings.batch / (time.monotonic() - begun)
                report(run, training, [value / EVERY for value in sums], speed)
                sums = [0.0] * 3
            if training.step % KEPT_EVERY == 0 or training.step == settings.steps:
                training.save(run / CHECKPOINT)
                torch.save(training.mean.state_dict(), run / f"step-{training.step:06}.pt")
    finally:
        batches.close()


def report(run, training, values, speed):
    """A line of the log, and the progress."""
    step, settings = training.step, training.settings
    rate = rate_at(step - 1, settings)
    line = [step, step * settings.batch, *(f"{value:.4f}" for value in values), f"{rate:.6f}"]
    log = run / LOG
    rows = []
    if log.exists():
        # What a stopped run logged after its last checkpoint is done again.
        rows = [row for row in csv.reader(log.open()) if row[0] != "step" and int(row[0]) < step]
    with log.open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *rows, line])
    left = (settings.steps - step) * settings.batch / max(speed, 1e-9) / 60
    print(
        f"step {step} of {settings.steps}: loss {values[0]:.3f}, overlap {values[2]:.3f}, "
        f"{speed:.0f} pairs/s, {left:.0f} min left",
        file=sys.stderr,
        flush=True,
    )
