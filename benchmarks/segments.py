#!/usr/bin/env python3
"""Makes six sequences of each target of a dataset, so that a comparison depends less on luck.

    python3 benchmarks/segments.py OTB --out segments/OTB
    python3 benchmarks/segments.py MINE --out segments/MINE
    python3 benchmarks/ablate.py segments/OTB segments/MINE --out results/tried \\
        --variant robust --variant wide search=6

    python3 benchmarks/segments.py OTB --out short/OTB --frames 200
    python3 benchmarks/segments.py OTB --out starts/OTB --whole

A tracker that hardly keeps a target, or hardly loses it, does the other after the smallest change, which
moves the mean over a dataset by as much as most ideas do. DATASET is a folder in the OTB layout. Each target
is tracked forwards from the first frame, from a quarter and from half of its frames, and backwards from the
last frame likewise. With --whole, it is tracked forwards from the first frame three times: from its first
box, and from that box moved by a thousandth of a pixel to the right and to the left, which no user could tell
from each other. With --frames, each sequence ends after that many frames; comparisons then take a fraction of
the time. Images are symbolic links; OUT must not exist. Requires only Python 3.11 or newer.
"""

import argparse
import re
import sys
from pathlib import Path

# Name, whether backwards, and the share of the frames that is left out at the start.
SEGMENTS = [(f"{way}{k}", way == "r", k / 4) for way in "fr" for k in range(3)]
# Name, and by how many pixels the first box is moved.
STARTS = [("s0", 0.0), ("s1", 0.001), ("s2", -0.001)]


def number(image: Path) -> tuple[int, str]:
    """The number of a frame, by which images are in order."""
    return int(re.sub(r"\D", "", image.stem) or 0), image.name


def moved(box: str, by: float) -> str:
    """A box as text, moved to the right."""
    x, rest = re.split(r"([\s,].*)", box.strip(), maxsplit=1)[:2]
    return f"{float(x) + by:.3f}{rest}" if by else box


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("dataset", metavar="DATASET", type=Path, help="a folder in the OTB layout")
    parser.add_argument("--out", required=True, type=Path, help="folder for the sequences; must not exist")
    parser.add_argument("--whole", action="store_true", help="three whole sequences in place of the segments")
    parser.add_argument("--frames", type=int, metavar="N", help="at most this many frames of each sequence")
    args = parser.parse_args()
    if args.frames is not None and args.frames < 2:
        parser.error(f"--frames {args.frames}: takes at least 2, as the first frame is given")
    if args.whole:
        parts = [(name, False, 0.0, shift) for name, shift in STARTS]
    else:
        parts = [(*segment, 0.0) for segment in SEGMENTS]
    truths = sorted(args.dataset.glob("*/groundtruth_rect*.txt"))
    if not truths:
        parser.error(f"{args.dataset}: no groundtruth_rect*.txt in its folders; is it in the OTB layout?")
    if args.out.exists():
        parser.error(f"--out {args.out}: exists already; name another folder, or remove it")
    if lacking := [truth.parent for truth in truths if not (truth.parent / "img").is_dir()]:
        parser.error(f"{lacking[0]}: has no folder img; is it in the OTB layout?")
    for truth in truths:
        boxes = [line for line in truth.read_text(encoding="utf-8").splitlines() if line.strip()]
        # Some sequences have more images than boxes.
        images = sorted((truth.parent / "img").iterdir(), key=number)[: len(boxes)]
        boxes = boxes[: len(images)]
        target = truth.parent.name + "".join(f"_{k}" for k in re.findall(r"\.(\d+)\.txt$", truth.name))
        for name, backwards, left_out, shift in parts:
            order = list(zip(images, boxes, strict=True))[:: -1 if backwards else 1]
            order = order[int(len(order) * left_out) :][: args.frames]
            folder = args.out / f"{target}-{name}"
            (folder / "img").mkdir(parents=True)
            for k, (image, _) in enumerate(order, 1):
                (folder / "img" / f"{k:06}{image.suffix}").symlink_to(image.resolve())
            first, *others = (box for _, box in order)
            text = "".join(f"{box}\n" for box in [moved(first, shift), *others])
            (folder / "groundtruth_rect.txt").write_text(text, encoding="utf-8")
    print(f"{len(truths) * len(parts)} sequences are in {args.out}", file=sys.stderr)


if __name__ == "__main__":
    main()
