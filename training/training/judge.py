"""Follows the targets of development sets with the network alone, and scores the boxes."""

import os
import re
import sys
from pathlib import Path

import cv2
import numpy as np
import onnxruntime

from .export import FILES
from .geometry import CELLS, SEARCH, STRIDE, TEMPLATE, context_side, window

# Share of the Hann window, punishment of changes of size, and how fast the size follows.
WINDOW, PENALTY, RATE = 0.45, 0.2, 0.1
# The template is half a running mean over frames with a score above the last of these.
SHARE, MEAN_RATE, FOUND = 0.5, 0.05, 0.3
SMALLEST = 6
# Looks at each target by `single_looks`.
LOOKS = 50
THRESHOLDS = np.arange(0, 1.01, 0.05)
CENTRES = (np.arange(CELLS) - (CELLS - 1) / 2) * STRIDE
HANN = np.outer(np.hanning(CELLS + 2)[1:-1], np.hanning(CELLS + 2)[1:-1])
# David's truth begins at frame 300.
FIRST_FRAME = {"David": 300}


def change(ratio):
    return np.maximum(ratio, 1 / ratio)


class Network:
    """The exported files, run by onnxruntime on one thread."""

    def __init__(self, folder):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        provider = ["CPUExecutionProvider"]
        self.backbone, self.head = (
            onnxruntime.InferenceSession(str(folder / name), options, providers=provider)
            for name in FILES
        )

    def features(self, picture):
        planes = picture.transpose(2, 0, 1)[None].astype(np.float32)
        return self.backbone.run(None, {"picture": np.ascontiguousarray(planes)})[0]

    def look(self, template, picture):
        inputs = {"template": template, "window": self.features(picture)}
        score, sides = self.head.run(None, inputs)
        return 1 / (1 + np.exp(-score[0, 0])), sides[0]


class Tracker:
    """The plain loop: the best cell near the last place, its box, a slow size, and a template that
    follows the target."""

    def __init__(self, network, frame, box):
        self.network = network
        self.border = frame.reshape(-1, 3).mean(0)
        self.centre = box[:2] + box[2:] / 2
        self.size = box[2:].astype(float)
        side = context_side(*self.size)
        cut = window(frame, self.centre, side, TEMPLATE, self.border)
        self.first = self.mean = network.features(cut)

    def update(self, frame):
        side = context_side(*self.size)
        scale = side / TEMPLATE
        cut = window(frame, self.centre, scale * SEARCH, SEARCH, self.border)
        template = self.first + SHARE * (self.mean - self.first)
        score, (left, top, right, bottom) = self.network.look(template, cut)
        width, height = (left + right) * scale, (top + bottom) * scale
        aspect = change((width / height) / (self.size[0] / self.size[1]))
        punished = np.exp(-(change(context_side(width, height) / side) * aspect - 1) * PENALTY)
        ranked = punished * score * (1 - WINDOW) + HANN * WINDOW
        row, column = np.unravel_index(np.argmax(ranked), ranked.shape)
        shift = np.array(
            [
                CENTRES[column] + (right - left)[row, column] / 2,
                CENTRES[row] + (bottom - top)[row, column] / 2,
            ]
        )
        limits = np.array(frame.shape[1::-1])
        self.centre = np.clip(self.centre + shift * scale, 0, limits)
        rate = punished[row, column] * score[row, column] * RATE
        seen = np.array([width[row, column], height[row, column]])
        self.size = np.clip(self.size + rate * (seen - self.size), SMALLEST, limits)
        if score[row, column] > FOUND:
            cut = window(frame, self.centre, context_side(*self.size), TEMPLATE, self.border)
            self.mean = self.mean + MEAN_RATE * (self.network.features(cut) - self.mean)
        return np.concatenate([self.centre - self.size / 2, self.size])


def targets(data):
    """All targets: set, name, frames, truth."""
    for folder in sorted(data.glob("*/*")):
        for truth in sorted(folder.glob("groundtruth_rect*.txt")):
            part = re.search(r"rect(\.\d+)\.txt", truth.name)
            name = folder.name + (part[1] if part else "")
            frames = sorted((folder / "img").glob("*.jpg"))
            boxes = read_boxes(truth)
            skipped = max(0, len(frames) - len(boxes)) if folder.name in FIRST_FRAME else 0
            yield folder.parent.name, name, frames[skipped : skipped + len(boxes)], boxes


def read_boxes(path):
    """Left, top, width and height, a line each; not finite where the target is absent."""
    lines = [line.strip() for line in path.read_text().splitlines() if line.strip()]
    return np.array([[float(number) for number in re.split(r"[,\s]+", line)] for line in lines])


def read(path):
    image = cv2.imread(str(path))
    if image is None:
        raise ValueError(f"{path} is no picture that can be read")
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)


def overlaps(made, truth):
    ends = np.minimum(made[:, :2] + made[:, 2:], truth[:, :2] + truth[:, 2:])
    shared = np.maximum(ends - np.maximum(made[:, :2], truth[:, :2]), 0).prod(1)
    return shared / (made[:, 2:].prod(1) + truth[:, 2:].prod(1) - shared + 1e-9)


def follow(network, frames, truth):
    """The overlap in each frame in which the target is present."""
    boxes, tracker = [], None
    # OTB counts pixels from 1.
    truth = truth - [1, 1, 0, 0]
    for path in frames:
        frame = read(path)
        if tracker is None:
            tracker = Tracker(network, frame, truth[0])
            boxes.append(truth[0])
        else:
            boxes.append(tracker.update(frame))
    present = np.isfinite(truth).all(1) & (truth[:, 2:] > 0).all(1)
    return overlaps(np.array(boxes)[present], truth[present])


def area_under_curve(overlap):
    return np.mean([(overlap > threshold).mean() for threshold in THRESHOLDS])


def judge(folder, data, only=None):
    """The area under the curve of each target, by set."""
    cv2.setNumThreads(1)
    network, found = Network(folder), {}
    for group, name, frames, truth in targets(data):
        if only and name not in only:
            continue
        value = area_under_curve(follow(network, frames, truth))
        found.setdefault(group, {})[name] = value
        print(f"{group}/{name} {value:.3f}", file=sys.stderr, flush=True)
    if not found:
        raise FileNotFoundError(f"{data} holds no SET/SEQUENCE/groundtruth_rect.txt")
    return found


def single_looks(folder, data):
    """For looks near the target, far from the template's frame: the share that overlap by more
    than .3, and the mean overlap."""
    cv2.setNumThreads(1)
    network, rng, found = Network(folder), np.random.default_rng(5), []
    for _, _, frames, truth in targets(data):
        truth = truth - [1, 1, 0, 0]
        first = Tracker(network, read(frames[0]), truth[0])
        for number in np.linspace(1, len(frames) - 1, LOOKS).astype(int):
            if np.isfinite(truth[number]).all() and (truth[number, 2:] > 0).all():
                found.append(single_look(first, read(frames[number]), truth[number], rng))
    return np.mean(np.array(found) > 0.3), np.mean(found)


def single_look(tracker, frame, box, rng):
    """The overlap of the best cell's box, from a place and size near the truth."""
    side = context_side(*box[2:]) * np.exp(rng.normal(0, 0.1))
    scale = side / TEMPLATE
    centre = box[:2] + box[2:] / 2 + rng.normal(0, 10, 2) * scale
    cut = window(frame, centre, scale * SEARCH, SEARCH, tracker.border)
    score, sides = tracker.network.look(tracker.first, cut)
    row, column = np.unravel_index(np.argmax(score), score.shape)
    left, top, right, bottom = sides[:, row, column]
    start = np.array([CENTRES[column] - left, CENTRES[row] - top])
    found = np.concatenate([centre + scale * start, scale * np.array([left + right, top + bottom])])
    return overlaps(found[None], box[None])[0]


def default_data():
    """The folder of the sets, as the tests of the repository find it."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "data"
    return Path(os.environ.get("PATCHLOCK_DATA", beside))
