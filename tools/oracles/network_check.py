"""Writes what real networks answer on real frames, by onnxruntime, for a comparison within 0.001.

    python network_check.py MODELS SEQUENCES OUT [--targets David,Girl] [--frames 20]

Each folder in MODELS holds one network: two files for NanoTrack, whose names sort as backbone, head; one for
VitTrack. SEQUENCES is a folder in the OTB layout. Without --targets, its first three are used.

OUT/index.json describes the files; they are raw and little endian, and their paths are relative to OUT:
  - `targets`: `name`, `width`, `height`, and `frames`, decoded images: height x width x 3 bytes, RGB.
  - `calls`: `network` (path of the ONNX file), and `inputs` and `outputs`, each a list of tensors: `name`,
    `shape`, `file` (f32). There are the first and the last call of each file on each target; a NanoTrack
    backbone runs first on a template of 127 x 127, last on a search image of 255 x 255.
  - `tracks`: `networks` (paths), `target` (index into `targets`), and for each frame after the first the
    `boxes` (x, y, w, h, counted from 0) and `scores` of network.py. `first` is the box in the first frame.

Frames and weights belong to others: OUT must be below target/ or outside the repository.
"""

import argparse
import json
from pathlib import Path

import cv2
import network
import numpy as np
import peers


class Recorder:
    """A network that remembers its first and its last call."""

    def __init__(self, net):
        self.net, self.calls = net, []

    def run(self, names, inputs: dict[str, np.ndarray]) -> list[np.ndarray]:
        outputs = self.net.run(names, inputs)
        names = [output.name for output in self.net.get_outputs()]
        self.calls = [*self.calls[:1], (inputs, dict(zip(names, outputs)))]
        return outputs


class Writer:
    def __init__(self, out: Path):
        self.out, self.count = out, 0
        out.mkdir(parents=True, exist_ok=True)

    def file(self, values: np.ndarray) -> str:
        name = f"{self.count:05}.raw"
        self.count += 1
        values.tofile(self.out / name)
        return name

    def tensors(self, values: dict[str, np.ndarray]) -> list[dict]:
        return [
            {"name": name, "shape": list(tensor.shape), "file": self.file(tensor.astype("<f4"))}
            for name, tensor in values.items()
        ]


def record(tracker: network.NanoTrack | network.VitTrack) -> list[Recorder]:
    """Puts recorders around a tracker's networks, in the order of their files."""
    names = ["network"] if isinstance(tracker, network.VitTrack) else ["backbone", "head"]
    recorders = [Recorder(getattr(tracker, name)) for name in names]
    for name, recorder in zip(names, recorders):
        setattr(tracker, name, recorder)
    return recorders


def track(
    files: list[Path], frames: list[np.ndarray], first: network.Box, writer: Writer
) -> tuple[dict, list]:
    """The track of one network on one target, and its calls."""
    tracker = network.load(files)
    recorders = record(tracker)
    tracker.start(frames[0], first)
    boxes, scores = [], []
    for frame in frames[1:]:
        boxes.append([float(value) for value in tracker.update(frame)])
        scores.append(float(tracker.score))
    calls = [
        {"network": str(file), "inputs": writer.tensors(inputs), "outputs": writer.tensors(outputs)}
        for file, recorder in zip(files, recorders)
        for inputs, outputs in recorder.calls
    ]
    return {
        "networks": [str(file) for file in files],
        "first": first,
        "boxes": boxes,
        "scores": scores,
    }, calls


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name in ("models", "sequences", "out"):
        parser.add_argument(name, type=Path, metavar=name.upper())
    parser.add_argument("--targets", type=peers.words, help="names, separated by commas")
    parser.add_argument("--frames", type=peers.count, default=20, help="frames of each target [default: 20]")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    models = [sorted(folder.glob("*.onnx")) for folder in sorted(args.models.resolve().iterdir())]
    targets = peers.find_targets(args.sequences, args.targets)
    writer = Writer(args.out)
    index = {"targets": [], "calls": [], "tracks": []}
    for k, target in enumerate(targets if args.targets else targets[:3]):
        frames = [network.read(path) for path in target.images[: args.frames]]
        height, width = frames[0].shape[:2]
        names = [writer.file(frame) for frame in frames]
        index["targets"].append({"name": target.name, "width": width, "height": height, "frames": names})
        x, y, w, h = target.first
        for files in filter(None, models):
            path, calls = track(files, frames, (x - 1, y - 1, w, h), writer)
            index["tracks"].append({**path, "target": k})
            index["calls"] += calls
    (args.out / "index.json").write_text(json.dumps(index) + "\n")
    print(f"wrote {len(index['calls'])} calls and {len(index['tracks'])} tracks to {args.out}")


if __name__ == "__main__":
    main()
