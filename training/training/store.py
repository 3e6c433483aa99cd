"""What pairs are made of: photographs, things cut out of them, and models."""

import pickle
import sys
from dataclasses import dataclass, field

import cv2
import numpy as np

from .models import Model, models
from .objects import SMALL, hull, segments
from .pictures import cutouts, photographs, shrunk

FILE = "store.pickle"
LEVELS = 4


@dataclass
class Cut:
    """A thing with a transparent surrounding. Those of a group were found together."""

    image: np.ndarray
    hull: np.ndarray
    group: int


@dataclass
class Segment:
    """A thing where it was photographed."""

    photograph: int
    hull: np.ndarray
    cut: int


@dataclass
class Store:
    photographs: list[np.ndarray]
    segments: list[Segment]
    # The cuts of the segments come first.
    cuts: list[Cut]
    models: list[Model] = field(default_factory=list)

    def prepare(self):
        """Computes what is not worth saving."""
        self.pyramids = [pyramid(image) for image in self.photographs]
        self.means = [image.reshape(-1, 3)[::97].mean(0) for image in self.photographs]
        self.groups = {}
        for number, cut in enumerate(self.cuts):
            self.groups.setdefault(cut.group, []).append(number)
        self.kinds = {}
        for number, model in enumerate(self.models):
            self.kinds.setdefault(model.group, []).append(number)
        return self


def pyramid(image):
    levels = [image]
    for _ in range(LEVELS - 1):
        size = [max(2, side // 2) for side in levels[-1].shape[1::-1]]
        levels.append(cv2.resize(levels[-1], size, interpolation=cv2.INTER_AREA))
    return levels


def build(work):
    """Makes the store of the packages that were fetched."""
    found = photographs(work)
    store = Store([image for _, image in found], [], [])
    for number, image in enumerate(store.photographs):
        for outline, image_cut in segments(image):
            store.segments.append(Segment(number, outline, len(store.cuts)))
            store.cuts.append(make_cut(image_cut, number))
        progress(f"segments: photograph {number + 1} of {len(store.photographs)}")
    for number, image in enumerate(cutouts(work)):
        # Neighbours in a folder are alike.
        store.cuts.append(make_cut(shrunk(image, SMALL), -1 - number // 6))
    store.models = list(models(work))
    for kind in ("segments", "models"):
        if not getattr(store, kind):
            raise ValueError(f"no {kind} were found in {work}/packages; sources.csv must name some")
    with (work / FILE).open("wb") as file:
        pickle.dump(store, file, protocol=4)
    progress(
        f"{len(store.photographs)} photographs, {len(store.segments)} segments, "
        f"{len(store.cuts) - len(store.segments)} cut-outs, {len(store.models)} models\n"
    )
    return store.prepare()


def make_cut(image, group):
    return Cut(image, hull((image[..., 3] > 128).astype(np.uint8)), group)


def load(work):
    """The store, as it was built."""
    path = work / FILE
    if not path.exists():
        raise FileNotFoundError(f"{path} is missing; run `python -m training pairs` first")
    with path.open("rb") as file:
        return pickle.load(file).prepare()


def progress(text):
    print(f"\r{text}", end="", file=sys.stderr, flush=True)
