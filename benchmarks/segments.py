#!/usr/bin/env python3
"""Makes six sequences of each target of a dataset, so that a comparison depends less on luck.

    python3 benchmarks/segments.py OTB --out segments/OTB
    python3 benchmarks/segments.py MINE --out segments/MINE
    python3 benchmarks/ablate.py segments/OTB segments/MINE --out results/tried \\
        --variant robust --variant wide search=6

A tracker that hardly keeps a target, or hardly loses it, does the other after the smallest change, which
moves the mean over a dataset by as much as most ideas do. DATASET is a folder in the OTB layout. Each target
is tracked forwards from the first frame, from a quarter and from half of its frames, and backwards from the
last frame likewise. Images are symbolic links; OUT must not exist. Requires only Python 3.11 or newer.
"""

import argparse
import re
import sys
from pathlib import Path

# Name, whether backwards, and the share of the frames that is left out at the start.
SEGMENTS = [(f"{way}{k}", way == "r", k / 4) for way in "fr" for k in range(3)]


def number(image: Path) -> tuple[int, str]:
    """The number of a frame, by which images are in order."""
    return int(re.sub(r"\D", "", image.stem) or 0), image.name


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("dataset", metavar="DATASET", type=Path, help="a folder in the OTB layout")
    parser.add_argument("--out", required=True, type=Path, help="folder for the sequences; must not exist")
    args = parser.parse_args()
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
        for name, backwards, left_out in SEGMENTS:
            order = list(zip(images, boxes, strict=True))[:: -1 if backwards else 1]
            order = order[int(len(order) * left_out) :]
            folder = args.out / f"{target}-{name}"
            (folder / "img").mkdir(parents=True)
            for k, (image, _) in enumerate(order, 1):
                (folder / "img" / f"{k:06}{image.suffix}").symlink_to(image.resolve())
            text = "".join(f"{box}\n" for _, box in order)
            (folder / "groundtruth_rect.txt").write_text(text, encoding="utf-8")
    print(f"{len(truths) * len(SEGMENTS)} sequences are in {args.out}", file=sys.stderr)


if __name__ == "__main__":
    main()
