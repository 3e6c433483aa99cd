#!/usr/bin/env python3
"""Fits what a committee of the default tracker and a network does with the words of its members.

    tools/python/setup.sh
    python3 benchmarks/segments.py OTB --out starts/OTB --whole
    target/python-venv/bin/python benchmarks/committee.py starts/OTB starts/MINE --model FOLDER

Each argument is a dataset in the OTB layout. On frames where the members disagree, a logistic regression says
whose box overlaps the truth by more, weighed by the difference: from the default tracker's log odds, and from
those that the network gives both places. The score is a second one, of whether the box overlaps the truth by at
least half. The table has the AUC of the committee as it is in the program, and with a choice that was fitted on
the other half of the targets, and what a score is worth that was fitted likewise.
"""

import argparse
import re
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import paired
import patchlock
from calibrate import Array, Frames, logistic, regression, worth

# As in crates/patchlock/src/committee/consensus.rs.
AGREE, LEAST_ODDS, SHARE = 0.4, 1e-4, 0.2
FILTERS, NETWORK = (-3.0, 5.0), (-4.0, 5.0)


class Network(NamedTuple):
    """What differs between networks."""

    judged: tuple[float, float]  # the range of its log odds as evidence
    box_weight: float


NETWORKS = {"PatchNet": Network((-0.5, 4.0), 0.64)}
OTHERS = Network((-3.0, 2.0), 1.0)


class Target(NamedTuple):
    """The frames of a sequence after its first, one row each."""

    name: str
    words: Array  # log odds of filters and network, those of the network for the filters' place, overlap of both
    overlaps: Array  # with the truth: filters, network, their mean, the committee; -1 without truth
    visible: Array  # the share; NaN where it is not known
    network: Network


def mean(boxes: list[tuple[float, ...]], log_odds: list[float], network: Network) -> tuple[float, ...]:
    """As the committee averages boxes."""
    weights = np.exp(SHARE * np.array(log_odds)) * [1.0, network.box_weight]
    centre = np.average([[x + (w - 1) / 2, y + (h - 1) / 2] for x, y, w, h in boxes], axis=0, weights=weights)
    w, h = np.exp(np.average(np.log([box[2:] for box in boxes]), axis=0, weights=weights))
    return (centre[0] - (w - 1) / 2, centre[1] - (h - 1) / 2, w, h)


def track(sequence: Path, model: Path, network: Network) -> Target:
    true = paired.boxes_from_0(sequence / "groundtruth_rect.txt")
    words, overlaps, visible = [], [], []
    for k, image in patchlock.Frames(str(sequence / "img")):
        if k == 0:
            tracker = patchlock.Tracker(image, true[0], model=model)
        elif k < len(true):
            estimate, seen = tracker.update_observed(image)
            members = list(seen.estimates.values())
            boxes = [tuple(member.box) for member in members]
            odds = [min(max(member.score, LEAST_ODDS), 1 - LEAST_ODDS) for member in members]
            log_odds = [float(np.log(p / (1 - p))) for p in odds]
            judged = seen.judgements["filters"]
            words.append([*log_odds, 0.0 if judged is None else judged, paired.overlap(*boxes)])
            boxes += [mean(boxes, log_odds, network), tuple(estimate.box)]
            overlaps.append([paired.overlap(box, true[k]) if true[k] else -1.0 for box in boxes])
            shown = estimate.visibility
            visible.append(np.nan if shown is None else float(np.mean([part.mean() for part in shown])))
    name = re.sub(r"-[frs]\d$", "", sequence.name)
    return Target(name, np.array(words), np.array(overlaps), np.array(visible), network)


def choice(target: Target) -> Array:
    """The columns of the choice of the network's place."""
    filters, network, judged, _ = target.words.T
    evidence = np.clip(network, *target.network.judged) - np.clip(judged, *target.network.judged)
    return np.stack([np.ones(len(filters)), -filters, evidence], axis=1)


def score(target: Target, network: Array) -> Array:
    """The columns of the score, where the network's place is chosen on these frames."""
    agree = target.words[:, 3] > AGREE
    filters, other = np.clip(target.words[:, 0], *FILTERS), np.clip(target.words[:, 1], *NETWORK)
    alone = [~agree & ~network, ~agree & network]
    columns = [agree, agree * target.words[:, 3], agree * filters, agree * other, ~agree]
    return np.stack([*columns, alone[0] * filters, alone[1] * other], axis=1).astype(float)


def chosen(target: Target, weights: Array) -> tuple[Array, Array]:
    """On which frames the network's place is chosen, and the overlap of the committee's box with the truth."""
    agree, network = target.words[:, 3] > AGREE, choice(target) @ weights > 0
    filters, other, both, _ = target.overlaps.T
    return network, np.where(agree, both, np.where(network, other, filters))


def fit_choice(targets: list[Target]) -> Array:
    columns, overlaps = np.concatenate([choice(t) for t in targets]), np.concatenate([t.overlaps for t in targets])
    weight = np.concatenate([np.full(len(t.words), len(t.words) ** -0.5) for t in targets])
    apart = np.concatenate([t.words[:, 3] <= AGREE for t in targets]) & (overlaps[:, :2].max(axis=1) > 0.1)
    weight = weight * np.abs(overlaps[:, 1] - overlaps[:, 0])
    on = np.where(overlaps[:, 1] > overlaps[:, 0], 1.0, 0.0)
    return regression(columns[apart], Frames(columns[apart], on[apart], on[apart], weight[apart]), np.zeros(3))


def frames(targets: list[Target], weights: Array) -> Frames:
    """The frames of targets for the fit of the score."""
    parts = [chosen(target, weights) for target in targets]
    columns = [score(target, network) for target, (network, _) in zip(targets, parts, strict=True)]
    weight = [np.full(len(target.words), len(target.words) ** -0.5) for target in targets]
    overlap = np.concatenate([overlap for _, overlap in parts])
    return Frames(np.concatenate(columns), overlap, np.concatenate([t.visible for t in targets]), np.concatenate(weight))


def limited(score: Array, targets: list[Target]) -> Array:
    """What no member finds is not there, though they agree."""
    words = np.concatenate([target.words for target in targets])
    most = words[:, :2].max(axis=1)
    return np.where((words[:, 3] > AGREE) & (most < 0), np.minimum(score, logistic(most)), score)


def counted(score: Array, targets: list[Target]) -> Array:
    """The visible share, as the status counts it: 1 where the score is high and members are not apart, else 0 where they disagree."""
    visible = np.concatenate([target.visible for target in targets])
    overlap = np.concatenate([target.words[:, 3] for target in targets])
    sure = (score >= paired.SURE) & (overlap > 0)
    return np.where(sure, 1.0, np.where(overlap > AGREE, np.nan_to_num(visible), 0.0))


def auc(overlaps: list[Array]) -> str:
    """The mean AUC over targets, of frames after the first."""
    means = [np.mean([(o[o >= 0] > k / 20).mean() for k in range(21)]) for o in overlaps]
    return f"{np.mean(means):.4f}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("datasets", nargs="+", type=Path, metavar="DATASET", help="in the OTB layout")
    parser.add_argument("--model", type=Path, required=True, metavar="FOLDER", help="the network")
    args = parser.parse_args()
    sequences = [file.parent for data in args.datasets for file in sorted(data.glob("*/groundtruth_rect.txt"))]
    if not sequences:
        sys.exit(f"error: {args.datasets[0]} has no SEQUENCE/groundtruth_rect.txt")
    network = NETWORKS.get(patchlock.Network(args.model).name, OTHERS)
    with ProcessPoolExecutor() as pool:
        targets = list(pool.map(partial(track, model=args.model, network=network), sequences))
    weights = fit_choice(targets)
    fitted = frames(targets, weights)
    names = ["agree", "overlap", "filters", "network", "apart", "filters alone", "network alone"]
    numbers = regression(fitted.columns, fitted, np.zeros(7))
    print("choice:", *[f"{name} {n:.3f}" for name, n in zip(["bias", "filters", "judged"], weights, strict=True)])
    print("score:", *[f"{name} {n:.2f}" for name, n in zip(names, numbers, strict=True)])
    limits = {row.name: float(row.default) for row in patchlock.parameters(research=True) if row.name in
              ("score_tracked", "visible_tracked", "score_lost")}
    columns = "AUC, tracked that are off, off called tracked, off called lost, on called lost, >= .9 missed, ECE, AUROC, called tracked"
    print(f"\n| targets | {columns.replace(', ', ' | ')} |\n" + "|---" * 10 + "|")
    halves = {half: [t for t in targets if paired.half(t.name) == half] for half in ("tuning", "other")}
    unseen = []
    for half, others in (("tuning", "other"), ("other", "tuning")):
        choose = fit_choice(halves[others])
        seen, own = frames(halves[others], choose), frames(halves[half], choose)
        fitted_score = logistic(own.columns @ regression(seen.columns, seen, np.zeros(7)))
        fitted_score = limited(fitted_score, halves[half])
        unseen.append((own._replace(visible=counted(fitted_score, halves[half])), fitted_score))
        values = worth(*unseen[-1], limits)
        parts = [chosen(target, choose)[1] for target in halves[half]]
        print(f"| half {half}, fitted on the other | {auc(parts)} | {' | '.join(values)} |")
    together = Frames(*(np.concatenate(parts) for parts in zip(*(own for own, _ in unseen), strict=True)))
    values = worth(together, np.concatenate([score for _, score in unseen]), limits)
    print(f"| all, fitted on the other half | | {' | '.join(values)} |")
    print(f"| all, as it is | {auc([target.overlaps[:, 3] for target in targets])} |" + " |" * 8)


if __name__ == "__main__":
    main()
