"""Statistics for ablate.py: what a variant of the tracker changes, over targets.

The frames of a segment give its measures, the mean over its segments is a target's, and targets are the unit
of the statistics: frames of one target are not independent, targets nearly are. A difference is paired: that
of the same target. Its standard error is that of the mean over targets, by bootstrap; s / sqrt(n) is a check.

Half of the targets, by a hash of their names, is for tuning. The other half shows whether what was tuned
holds elsewhere, so all results are given for both.
"""

import hashlib
import json
import math
import random
import re
import statistics
import sys
from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

Number = float | None
Box = tuple[float, float, float, float]

# METHODOLOGY.md has the formulas.
THRESHOLDS = [k / 20 for k in range(21)]
NEAR = 20.0
OFF = 0.1
ON = 0.5
BINS = 10
# A segment is lost if the target is lost in more than this share of its frames.
LOST_SEGMENT = 0.2
# The segments and starts that begin with the first frame of a target.
FIRST = ["f0", "s0", "s1", "s2"]
# A score that a user takes for certain.
SURE = 0.9

RESAMPLES = 10_000
SEED = 1
PARTS = ("all", "tuning", "other")
# A set may lose this much of its AUC if the mean over all targets gains.
LOSS_OF_A_SET = 0.01


@dataclass
class Target:
    """A target of one of the sets, with the names of its segments."""

    set: str
    name: str
    attributes: list[str]
    segments: list[str]

    def is_in(self, part: str) -> bool:
        return part in ("all", half(self.name))


@dataclass
class Run:
    """A tracker's frames of a segment. Without a status and a score, the tracker has none."""

    segment: str  # its name in segments.py
    overlaps: list[Number]  # None in a frame without truth
    auc: Number
    dp: Number
    lost: Number
    status: list[str]
    score: list[float]
    seconds: list[float]  # empty if runs were made in parallel

    @property
    def is_lost(self) -> bool:
        return self.lost is not None and self.lost > LOST_SEGMENT


# One for each segment and seed of each target, in the order of the targets.
Runs = list[list[Run]]


def half(name: str) -> str:
    """The half of the targets to which one belongs."""
    return "other" if hashlib.sha256(name.encode()).digest()[-1] % 2 else "tuning"


# --- Frames ------------------------------------------------------------------


def boxes(file: Path) -> list[Box | None]:
    """The boxes of a file, one a line; None for a line without one."""
    rows: list[Box | None] = []
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        try:
            x, y, w, h = map(float, re.split(r"[,\s]+", line.strip()))
        except ValueError:
            sys.exit(f"error: {file}, line {number}: '{line}' is not x, y, width and height")
        rows.append((x, y, w, h) if all(map(math.isfinite, (x, y, w, h))) and min(w, h) > 0 else None)
    return rows


def boxes_from_0(file: Path) -> list[Box | None]:
    """The boxes of a file in the layout of OTB, whose first pixel is 1, as trackers count: from 0."""
    return [box and (box[0] - 1, box[1] - 1, *box[2:]) for box in boxes(file)]


def overlap(a: Box, b: Box) -> float:
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    shared = max(width, 0.0) * max(height, 0.0)
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)


def distance(a: Box, b: Box) -> float:
    """The distance of the centres."""
    return math.hypot(a[0] - b[0] + (a[2] - b[2]) / 2, a[1] - b[1] + (a[3] - b[3]) / 2)


def run_of(
    segment: str,
    own: list[Box | None],
    truth: list[Box | None],
    said: dict[str, list],
    seconds: list[float],
) -> Run:
    """The run with these boxes. `said` may have a status and a score for each frame."""
    overlaps: list[Number] = []
    near = 0
    last = None
    for box, true in zip(own, truth, strict=True):
        last = box or last
        if true is None:
            overlaps.append(None)
        else:
            overlaps.append(overlap(last, true) if last else 0.0)
            near += last is not None and distance(last, true) <= NEAR
    known = [value for value in overlaps if value is not None]
    auc = mean([bisect_left(THRESHOLDS, value) / len(THRESHOLDS) for value in known])
    lost = mean([float(value < OFF) for value in known])
    dp = near / len(known) if known else None
    status, score = said.get("status") or [], said.get("score") or []
    return Run(segment, overlaps, auc, dp, lost, status, score, seconds)


def read_run(file: Path, segment: str, truth: list[Box | None]) -> Run:
    """The run of which `patchlock bench` wrote the boxes into this file."""
    own = boxes(file)
    if len(own) != len(truth):
        sys.exit(f"error: {file}: has {len(own)} boxes, and the truth {len(truth)}")
    manifest = file.with_suffix(".json")
    said = json.loads(manifest.read_text(encoding="utf-8")) if manifest.is_file() else {}
    return run_of(segment, own, truth, said, said["seconds"] if said.get("jobs") == 1 else [])


# --- Statistics --------------------------------------------------------------


def mean(values: Iterable[Number]) -> Number:
    """The mean of the values that there are; None without any."""
    known = [value for value in values if value is not None]
    return statistics.fmean(known) if known else None


def bootstrap_error(values: list[float]) -> Number:
    """The standard error of the mean: its deviation over samples drawn from the values with replacement."""
    if len(values) < 2:
        return None
    draw = random.Random(SEED)
    return statistics.stdev(sum(draw.choices(values, k=len(values))) for _ in range(RESAMPLES)) / len(values)


def paired(pairs: list[tuple[Number, Number]]) -> dict[str, Number]:
    """The mean difference in pairs of the baseline's value and the variant's, with its standard errors."""
    known = [(base, own) for base, own in pairs if base is not None and own is not None]
    changes = [own - base for base, own in known]
    plain = statistics.stdev(changes) / math.sqrt(len(changes)) if len(changes) > 1 else None
    return {
        "targets": len(known),
        "baseline": mean(base for base, _ in known),
        "value": mean(own for _, own in known),
        "difference": mean(changes),
        "error": bootstrap_error(changes),
        "plain_error": plain,
    }


def by_part(targets: list[Target], what: Callable[[list[int]], dict]) -> dict[str, dict]:
    """What there is to say of all targets and of both halves; `what` gets the places of the targets."""
    return {part: what([k for k, target in enumerate(targets) if target.is_in(part)]) for part in PARTS}


def of_targets(runs: Runs, measure: str) -> list[Number]:
    return [mean(getattr(run, measure) for run in one) for one in runs]


def differences(targets: list[Target], base: Runs, own: Runs) -> dict[str, dict]:
    """By measure and part."""

    def of(measure: str) -> dict[str, dict]:
        pairs = list(zip(of_targets(base, measure), of_targets(own, measure), strict=True))
        return by_part(targets, lambda places: paired([pairs[k] for k in places]))

    return {measure: of(measure) for measure in ("auc", "dp", "lost")}


def chosen(which: list[bool], *lists: list) -> list[list]:
    return [[item for item, is_in in zip(items, which) if is_in] for items in lists]


def grouped(targets: list[Target], base: Runs, own: Runs, names: list[str], has: Callable) -> dict[str, dict]:
    """The differences in each group of targets."""
    groups = {}
    for name in names:
        which = [has(target, name) for target in targets]
        groups[name] = differences(*chosen(which, targets, base, own))
    return groups


def segments(targets: list[Target], base: Runs, own: Runs) -> dict[str, dict]:
    """By part: how many segments are lost, and the difference in AUC where both keep the target, and in the
    other segments."""

    def change(places: list[int], is_wanted: Callable[[Run, Run], bool]) -> dict[str, Number]:
        pairs = []
        for k in places:
            runs = [(a, b) for a, b in zip(base[k], own[k], strict=True) if is_wanted(a, b)]
            pairs.append((mean(a.auc for a, _ in runs), mean(b.auc for _, b in runs)))
        return paired(pairs)

    def of(places: list[int]) -> dict:
        both = [(a.is_lost, b.is_lost) for k in places for a, b in zip(base[k], own[k], strict=True)]
        return {
            "segments": len(both),
            "lost": sum(b for _, b in both),
            "newly_lost": sum(b and not a for a, b in both),
            "newly_kept": sum(a and not b for a, b in both),
            "auc_kept_by_both": change(places, lambda a, b: not (a.is_lost or b.is_lost)),
            "auc_other_segments": change(places, lambda a, b: a.is_lost or b.is_lost),
        }

    return by_part(targets, of)


# --- Status and score --------------------------------------------------------


def share(part: int, whole: int) -> Number:
    return part / whole if whole else None


def ece(frames: list[tuple[float, bool]]) -> Number:
    """The expected calibration error of scores, each with whether the box is on the target."""
    sums = [0.0] * BINS
    for score, is_on in frames:
        sums[min(int(score * BINS), BINS - 1)] += score - is_on
    return sum(map(abs, sums)) / len(frames) if frames else None


def auroc(frames: list[tuple[float, bool]]) -> Number:
    """The share of pairs of a hit and a miss in which the hit has the larger score; equal ones count half."""
    counts: dict[float, list[int]] = {}
    for score, is_on in frames:
        counts.setdefault(score, [0, 0])[is_on] += 1
    misses = hits = 0
    pairs = 0.0
    for score in sorted(counts):
        missed, hit = counts[score]
        pairs += hit * (misses + missed / 2)
        misses += missed
        hits += hit
    return pairs / (hits * misses) if hits and misses else None


def promises(targets: list[Target], own: Runs, segments: list[str]) -> dict[str, dict]:
    """By part: what status and score are worth, over all frames of these segments but the first of each run.
    Off is a frame without truth, or with an overlap below OFF."""

    def of(places: list[int]) -> dict[str, Number]:
        runs = [run for k in places for run in own[k] if run.segment in segments]
        said = [pair for run in runs for pair in list(zip(run.status, run.overlaps))[1:]]
        off = [status for status, value in said if value is None or value < OFF]
        tracked = sum(status == "tracked" for status, _ in said)
        frames = [
            (score, value is not None and value >= ON)
            for run in runs
            for score, value in list(zip(run.score, run.overlaps))[1:]
        ]
        sure = [is_on for score, is_on in frames if score >= SURE]
        return {
            "tracked_off": share(off.count("tracked"), tracked),
            "off_tracked": share(off.count("tracked"), len(off)),
            "off_lost": share(off.count("lost"), len(off)),
            "sure_missed": share(sure.count(False), len(sure)),
            "ece": ece(frames),
            "auroc": auroc(frames),
        }

    return by_part(targets, of)


# --- All of it ---------------------------------------------------------------


def verdict(all_targets: dict[str, Number], sets: list[dict[str, Number]]) -> str:
    """`gain` if the mean over all targets gains more than its standard error and no set loses much."""
    gain, error = all_targets["difference"], all_targets["error"]
    is_gain = gain is not None and error is not None and gain > error
    losses = [one["difference"] for one in sets if one["difference"] is not None]
    return "gain" if is_gain and min(losses) >= -LOSS_OF_A_SET else "no"


def compare(targets: list[Target], base: Runs, own: Runs) -> dict:
    """All that there is to say of a variant beside the baseline."""
    sets = sorted({target.set for target in targets})
    attributes = sorted({attribute for target in targets for attribute in target.attributes})
    by_set = grouped(targets, base, own, sets, lambda target, name: target.set == name)
    together = differences(targets, base, own)
    seconds = [second for runs in own for run in runs for second in run.seconds]
    return {
        "all": together,
        "by_set": by_set,
        "by_attribute": grouped(
            targets, base, own, attributes, lambda target, name: name in target.attributes
        ),
        "segments": segments(targets, base, own),
        "promises": promises(targets, own, sorted({run.segment for runs in own for run in runs})),
        "promises_first": promises(targets, own, FIRST),
        "fps": 1 / statistics.median(seconds) if seconds else None,
        "verdict": verdict(together["auc"]["all"], [one["auc"]["all"] for one in by_set.values()]),
        "targets": [
            {"set": target.set, "name": target.name, "half": half(target.name)}
            | {measure: mean(getattr(run, measure) for run in runs) for measure in ("auc", "dp", "lost")}
            | {"runs": [{key: getattr(run, key) for key in ("segment", "auc", "dp", "lost")} for run in runs]}
            for target, runs in zip(targets, own, strict=True)
        ],
    }
