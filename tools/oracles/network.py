"""Follows a target with a NanoTrack (v2, v3) or VitTrack network, in the published loop, by onnxruntime.

    python network.py DATA OUT BACKBONE.onnx HEAD.onnx     # NanoTrack
    python network.py DATA OUT VITTRACK.onnx               # VitTrack

DATA is a folder in the OTB layout. OUT/<target>.txt gets one box `x,y,w,h` per frame, counted from 1, as
`patchlock score` reads them. The networks and the frames belong to others: never commit them, or boxes made
with them.

Conventions:
  - A box is x, y, w, h in pixels, counted from 0. Its centre is (x + w/2, y + h/2).
  - Frames are RGB, 8 bits per channel. The colour of the pixel in column i and row j is a sample at the point
    (i, j). So the centre of a box lies half a pixel right of and below the middle of its pixels. The networks
    were trained with such boxes: with windows around the middle of the pixels instead, their boxes lie half a
    pixel further right and below the truth.
  - Everything is f64 but the crops and the networks, which are f32.
"""

import argparse
import sys
from pathlib import Path

import cv2
import numpy as np
import onnx
import onnxruntime

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "benchmarks"))
import peers

Box = tuple[float, float, float, float]
MIN_SIDE = 10.0
# NanoTrack by the cells per axis of its maps: punishment of a new size or shape, weight of the window, rate
# at which the size follows.
NANOTRACK = {15: (0.138, 0.455, 0.348), 16: (0.150, 0.490, 0.385)}


def session(path: Path, threads: int = 1, free_size: bool = False) -> onnxruntime.InferenceSession:
    """Loads a network. With `free_size` its images may have any height and width.

    The published backbones declare images of 255 x 255, but also run on templates of 127 x 127.
    """
    model = onnx.load(path)
    if free_size:
        for value in [*model.graph.input, *model.graph.output]:
            for dimension in value.type.tensor_type.shape.dim[2:]:
                dimension.Clear()
        del model.graph.value_info[:]
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(model.SerializeToString(), options, ["CPUExecutionProvider"])


def taps(middle: float, side: float, size: int) -> tuple[np.ndarray, np.ndarray]:
    """The pixels before `size` samples spread over `side` pixels, and the weights of the next pixels."""
    at = middle + (np.arange(size) - (size - 1) / 2) * side / size
    before = np.floor(at).astype(int)
    return before, (at - before).astype(np.float32)


def crop(frame: np.ndarray, centre: tuple[float, float], side: float, size: int, fill) -> np.ndarray:
    """Samples a square window bilinearly: `size` x `size` x 3, f32, 0 to 255.

    Sample (i, j) lies at centre + ((i, j) - (size - 1) / 2) * side / size. A pixel outside the frame has the
    colour `fill`. Nothing is smoothed before shrinking, and nothing is rounded.
    """
    (x, right), (y, below) = (taps(middle, side, size) for middle in centre)
    x, y = np.concatenate([x, x + 1]), np.concatenate([y, y + 1])
    height, width = frame.shape[:2]
    pixels = frame.take(y.clip(0, height - 1), 0).take(x.clip(0, width - 1), 1).astype(np.float32)
    pixels[(y < 0) | (y >= height)] = fill
    pixels[:, (x < 0) | (x >= width)] = fill
    rows = pixels[:size] + (pixels[size:] - pixels[:size]) * below[:, None, None]
    return rows[:, :size] + (rows[:, size:] - rows[:, :size]) * right[:, None]


def tensor(image: np.ndarray) -> np.ndarray:
    """Height x width x 3 to 1 x 3 x height x width."""
    return np.ascontiguousarray(image.transpose(2, 0, 1)[None], np.float32)


class Follower:
    """The centre and the size of the target, in pixels."""

    def __init__(self, cut=crop):
        self.cut = cut

    def place(self, box: Box) -> None:
        x, y, w, h = box
        self.x, self.y, self.w, self.h = x + w / 2, y + h / 2, w, h

    def clamp(self, frame: np.ndarray) -> Box:
        """Keeps the centre inside the frame and the size between MIN_SIDE and the frame's; gives the box."""
        height, width = frame.shape[:2]
        self.x, self.y = min(max(self.x, 0.0), width), min(max(self.y, 0.0), height)
        self.w = max(min(self.w, width), MIN_SIDE)
        self.h = max(min(self.h, height), MIN_SIDE)
        return self.x - self.w / 2, self.y - self.h / 2, self.w, self.h


def context(w, h):
    """The side of the square around a box and its surroundings, half of (w + h) more on each axis."""
    margin = (w + h) / 2
    return np.sqrt((w + margin) * (h + margin))


def change(ratio):
    """By what factor something grew or shrank, at least 1."""
    return np.maximum(ratio, 1 / ratio)


class NanoTrack(Follower):
    """NanoTrack v3 if the head's maps have 15 x 15 cells, v2 if they have 16 x 16."""

    TEMPLATE, SEARCH, STRIDE = 127, 255, 16

    def __init__(self, backbone: Path, head: Path, threads: int = 1, cut=crop):
        super().__init__(cut)
        self.backbone, self.head = session(backbone, threads, free_size=True), session(head, threads)
        cells = self.head.get_outputs()[0].shape[-1]
        self.punishment, self.influence, self.rate = NANOTRACK[cells]
        self.window = np.outer(np.hanning(cells), np.hanning(cells))
        # Points of the cells in the search crop, relative to its centre. With 16 cells none lies at 128.
        points = (np.arange(cells) - cells // 2) * float(self.STRIDE)
        self.points = np.meshgrid(points, points)

    def features(self, frame: np.ndarray, side: float, size: int) -> np.ndarray:
        image = tensor(self.cut(frame, (self.x, self.y), side, size, self.mean))
        return self.backbone.run(None, {"input": image})[0]

    def start(self, frame: np.ndarray, box: Box) -> None:
        self.place(box)
        self.mean = frame.mean((0, 1))
        self.template = self.features(frame, context(self.w, self.h), self.TEMPLATE)

    def update(self, frame: np.ndarray) -> Box:
        side = context(self.w, self.h)
        scale = side / self.TEMPLATE  # pixels of the frame per pixel of a crop
        search = self.features(frame, scale * self.SEARCH, self.SEARCH)
        logits, edges = self.head.run(None, {"input1": self.template, "input2": search})
        logits, edges = logits[0].astype(float), edges[0].astype(float)
        self.logits = logits[1] - logits[0]
        score = 1 / (1 + np.exp(-self.logits))  # softmax of class 1
        left, top = self.points[0] - edges[0], self.points[1] - edges[1]
        right, bottom = self.points[0] + edges[2], self.points[1] + edges[3]
        w, h = (right - left) * scale, (bottom - top) * scale
        grown = change(context(w, h) / side)
        reshaped = change((self.w / self.h) / (w / h))
        penalty = np.exp(-(grown * reshaped - 1) * self.punishment)
        final = penalty * score * (1 - self.influence) + self.window * self.influence
        cell = np.unravel_index(final.argmax(), final.shape)  # the first of equal ones, row by row
        rate = penalty[cell] * score[cell] * self.rate
        self.x += (left[cell] + right[cell]) / 2 * scale
        self.y += (top[cell] + bottom[cell]) / 2 * scale
        self.w += rate * (w[cell] - self.w)
        self.h += rate * (h[cell] - self.h)
        self.score = score[cell]
        return self.clamp(frame)


class VitTrack(Follower):
    TEMPLATE, SEARCH, CELLS, MIN_SCORE = 128, 256, 16, 0.2
    MEAN, DEVIATION = np.array([0.485, 0.456, 0.406]), np.array([0.229, 0.224, 0.225])

    def __init__(self, network: Path, threads: int = 1, cut=crop):
        super().__init__(cut)
        self.network = session(network, threads)
        # The inner 16 of Hann's 18 values: none is 0.
        self.window = np.outer(np.hanning(self.CELLS + 2)[1:-1], np.hanning(self.CELLS + 2)[1:-1])

    def image(self, frame: np.ndarray, side: float, size: int) -> np.ndarray:
        """Outside the frame is black."""
        pixels = self.cut(frame, (self.x, self.y), side, size, 0.0)
        return tensor((pixels / 255 - self.MEAN) / self.DEVIATION)

    def start(self, frame: np.ndarray, box: Box) -> None:
        self.place(box)
        self.template = self.image(frame, 2 * np.sqrt(self.w * self.h), self.TEMPLATE)

    def update(self, frame: np.ndarray) -> Box:
        side = 4 * np.sqrt(self.w * self.h)
        search = self.image(frame, side, self.SEARCH)
        outputs = self.network.run(None, {"template": self.template, "search": search})
        score, size, offset = (output[0].astype(float) for output in outputs)
        score = score[0]
        row, column = np.unravel_index((score * self.window).argmax(), score.shape)
        self.score = score[row, column]
        if self.score >= self.MIN_SCORE:
            self.x += ((column + offset[0, row, column]) / self.CELLS - 0.5) * side
            self.y += ((row + offset[1, row, column]) / self.CELLS - 0.5) * side
            self.w, self.h = size[0, row, column] * side, size[1, row, column] * side
        return self.clamp(frame)


def load(networks: list[Path], threads: int = 1, cut=crop) -> NanoTrack | VitTrack:
    """NanoTrack from its backbone and its head, or VitTrack from its only file."""
    return (VitTrack if len(networks) == 1 else NanoTrack)(*networks, threads=threads, cut=cut)


def read(path: Path) -> np.ndarray:
    return cv2.cvtColor(cv2.imread(str(path), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def follow(tracker: NanoTrack | VitTrack, target: peers.Target) -> list[Box]:
    """The box in each image, counted from 1 like the given box."""
    x, y, w, h = target.first
    tracker.start(read(target.images[0]), (x - 1, y - 1, w, h))
    boxes = [target.first]
    for path in target.images[1:]:
        x, y, w, h = tracker.update(read(path))
        boxes.append((x + 1, y + 1, w, h))
    return boxes


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, metavar="DATA")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("networks", type=Path, nargs="+", metavar="NETWORK.onnx")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    tracker = load(args.networks)
    for target in peers.find_targets(args.data, None):
        boxes = follow(tracker, target)
        lines = [",".join(f"{value:.6g}" for value in box) for box in boxes]
        peers.write(args.out / f"{target.name}.txt", "\n".join(lines) + "\n")
        print(f"{target.name}: {len(boxes)} frames", flush=True)


if __name__ == "__main__":
    main()
