"""Makes pairs of a template and a window, with the target's box in the window.

A pair depends on the seed and its number alone.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from .geometry import (
    MIDDLE,
    SEARCH,
    TEMPLATE,
    Bend,
    box_of,
    context_side,
    inner,
    linear,
)
from .looks import Appearance, taken
from .render import placed, poses

# Shares of pairs: a target that moves with its surrounding, a cut-out before other surroundings,
# the rest a model that turns and moves its limbs.
NATURAL, PASTED = 0.4, 0.25
ABSENT = 0.06


def single_threaded():
    """OpenCV's threads cost more than they gain on pictures this small."""
    cv2.setNumThreads(1)


@dataclass
class Pair:
    template: np.ndarray
    window: np.ndarray
    # Left, top, right, bottom in the window; zeros if the target is absent.
    box: np.ndarray


@dataclass
class Motion:
    """How the target in the window differs from the template."""

    place: np.ndarray
    matrix: np.ndarray
    scale: float

    @classmethod
    def random(cls, rng):
        scale = np.exp(np.clip(rng.normal(0, 0.17), -0.4, 0.4))
        matrix = linear(
            scale, rng.normal(0, 0.14), np.exp(rng.normal(0, 0.09)), rng.normal(0, 0.05)
        )
        near = rng.random() < 0.65
        offset = rng.normal(0, 13, 2) if near else rng.uniform(-40, 40, 2)
        return cls(MIDDLE + np.clip(offset, -44, 44), matrix, scale)


def make(store, seed, number):
    """Pair `number`. A draw that shows too little of the target is drawn again."""
    rng = np.random.default_rng([seed, number])
    while True:
        chance = rng.random()
        kind = natural if chance < NATURAL else pasted if chance < NATURAL + PASTED else modelled
        pair = kind(store, rng, Motion.random(rng))
        if pair is not None:
            return finished(pair, rng)


def finished(pair, rng):
    """A pair as cameras take it, mirrored or not."""
    template, window, box = pair.template, pair.window, pair.box
    if rng.random() < 0.5:
        template, window = template[:, ::-1], window[:, ::-1]
        if box.any():
            box = np.array([SEARCH - box[2], box[1], SEARCH - box[0], box[3]])
    look = Appearance.random(rng)
    template = taken(np.ascontiguousarray(template), look, rng)
    window = taken(np.ascontiguousarray(window), look, rng)
    return Pair(template, window, box.astype(np.float32))


def is_seen(box):
    """Whether enough of the target lies in the window."""
    size = box[2:] - box[:2]
    inside = np.minimum(box[2:], SEARCH) - np.maximum(box[:2], 0)
    return size.min() >= 4 and np.maximum(inside, 0).prod() >= 0.35 * size.prod()


def view(store, number, matrix, source, target, pixels, border=None, sharp=False):
    """A window of a photograph, from the level of its pyramid that fits. `sharp` takes a finer
    one, as a tracker does that does not average."""
    levels = store.pyramids[number]
    scale = np.sqrt(abs(np.linalg.det(matrix)))
    level = np.floor(np.log2(1 / max(scale, 1e-6)) + 0.25) - (1 if sharp else 0)
    image = levels[int(np.clip(level, 0, len(levels) - 1))]
    whole = store.photographs[number].shape
    factor = np.array([whole[1] / image.shape[1], whole[0] / image.shape[0]])
    found = inner(matrix @ np.diag(factor), np.asarray(source) / factor, target)
    mode = cv2.BORDER_REFLECT_101 if border is None else cv2.BORDER_CONSTANT
    return cv2.warpAffine(
        image,
        found,
        (pixels, pixels),
        flags=cv2.INTER_LINEAR,
        borderMode=mode,
        borderValue=0 if border is None else tuple(float(value) for value in border),
    )


@dataclass
class Scene:
    """A place in a photograph."""

    photograph: int
    centre: np.ndarray
    scale: float

    @classmethod
    def random(cls, store, rng, pixels):
        number = int(rng.integers(len(store.photographs)))
        scale = np.exp(rng.uniform(np.log(0.25), np.log(1.6)))
        size = np.array(store.photographs[number].shape[1::-1])
        half = np.minimum(pixels / 2 / scale, size / 2)
        return cls(number, rng.uniform(half, size - half + 1e-6), scale)

    def near(self, rng):
        """The same scene from a moved camera."""
        moved = self.centre + rng.normal(0, 0.35, 2) * MIDDLE / self.scale
        return Scene(self.photograph, moved, self.scale * np.exp(rng.normal(0, 0.1)))

    def seen(self, store, rng, pixels):
        matrix = linear(self.scale, rng.normal(0, 0.05), np.exp(rng.normal(0, 0.05)), 0)
        middle = [pixels / 2] * 2
        return view(store, self.photograph, matrix, self.centre, middle, pixels)


def scenes(store, rng):
    """Surroundings of template and window: mostly the same scene."""
    scene = Scene.random(store, rng, TEMPLATE)
    other = scene.near(rng) if rng.random() < 0.6 else Scene.random(store, rng, SEARCH)
    return scene.seen(store, rng, TEMPLATE), other.seen(store, rng, SEARCH)


def natural(store, rng, motion):
    """A thing where it was photographed, seen again with its surrounding."""
    segment = store.segments[rng.integers(len(store.segments))]
    outline = segment.hull
    if rng.random() < 0.1:
        outline = any_box(store.photographs[segment.photograph], rng)
    box = box_of(outline)
    centre, size = (box[:2] + box[2:]) / 2, box[2:] - box[:2]
    scale = TEMPLATE / context_side(*size)
    number, sharp = segment.photograph, rng.random() < 0.3
    border = store.means[number] if rng.random() < 0.5 else None
    given = centre + rng.normal(0, 0.8, 2) / scale
    first = linear(scale * np.exp(rng.normal(0, 0.03)), 0, 1, 0)
    middle = [TEMPLATE / 2] * 2
    template = view(store, number, first, given, middle, TEMPLATE, border, sharp)
    group = store.cuts[segment.cut].group
    if rng.random() < ABSENT:
        window = Scene.random(store, rng, SEARCH).seen(store, rng, SEARCH)
        window = with_others(store, rng, window, segment.cut, group, motion, None)
        return Pair(template, window, np.zeros(4))
    matrix = motion.matrix * scale
    window = view(store, number, matrix, centre, motion.place, SEARCH, border, sharp)
    points = (outline - centre) @ matrix.T + motion.place
    if rng.random() < 0.5:
        bend = Bend(rng, rng.uniform(0.5, 2.5))
        window, points = bend.image(window), bend.points(points.astype(np.float32))
    box = box_of(points)
    if not is_seen(box):
        return None
    window = with_others(store, rng, window, segment.cut, group, motion, box)
    return Pair(template, covered(store, rng, window, box), box)


def any_box(image, rng):
    """A random part of a photograph: any patch may be a target."""
    size = np.array(image.shape[1::-1])
    sides = np.exp(rng.uniform(np.log(24), np.log(size.min() * 0.35), 2))
    sides[0] = np.clip(sides[0], sides[1] / 3, sides[1] * 3)
    sides = np.minimum(sides, size - 6)
    x, y = rng.uniform(2, size - sides - 2)
    w, h = sides
    return np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]], np.float32)


def pasted(store, rng, motion):
    """A cut-out before other surroundings."""
    things = len(store.segments)
    count = len(store.cuts)
    is_segment = count == things or rng.random() < 0.72
    number = int(rng.integers(things) if is_segment else rng.integers(things, count))
    cut = store.cuts[number]
    scale = TEMPLATE / context_side(*np.ptp(cut.hull, axis=0))
    shape = linear(1, rng.normal(0, 0.1), np.exp(rng.normal(0, 0.06)), rng.normal(0, 0.03))
    template, window = scenes(store, rng)
    gain = np.exp(rng.normal(0, 0.1))
    middle = [TEMPLATE / 2] * 2
    template, _ = paste(template, cut, scale * shape, middle, rng, 0.03, gain)
    window = with_others(store, rng, window, number, cut.group, motion, None)
    light = gain * np.exp(rng.normal(0, 0.08))
    window, box = paste(
        window, cut, scale * motion.matrix @ shape, motion.place, rng, 0.06, light, bent=True
    )
    if not is_seen(box):
        return None
    return Pair(template, covered(store, rng, window, box), box)


def modelled(store, rng, motion):
    """A model that turns and moves its limbs, before other surroundings."""
    number = int(rng.integers(len(store.models)))
    model = store.models[number]
    first, second = poses(rng, model)
    template, window = scenes(store, rng)
    template, box = placed(template, model, first, None, [TEMPLATE / 2] * 2)
    if box is None:
        return None
    scale = first.scale * motion.scale
    alike = store.kinds[model.group]
    others = int(rng.choice([0, 1, 2, 3], p=[0.35, 0.3, 0.2, 0.15]))
    for _ in range(others):
        other = store.models[alike[rng.integers(len(alike))]]
        place = free_place(rng, motion.place, None)
        if other is model or place is None:
            continue
        pose = poses(rng, other)[0]
        size = scale * model.size / other.size * np.exp(rng.normal(0, 0.15))
        window, _ = placed(window, other, pose, size, place)
    window, box = placed(window, model, second, scale, motion.place)
    if box is None or not is_seen(box):
        return None
    return Pair(template, covered(store, rng, window, box), box)


def paste(image, cut, matrix, place, rng, depth, gain, bent=False, channels=None):
    """Puts a cut-out with its middle at `place`. `depth` is the strength of the perspective."""
    pixels = image.shape[0]
    height, width = cut.image.shape[:2]
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    area = np.sqrt(abs(np.linalg.det(matrix)) * width * height)
    onto = (corners - [width / 2, height / 2]) @ matrix.T + place
    onto = onto + rng.uniform(-depth, depth, (4, 2)) * area
    found = cv2.getPerspectiveTransform(corners, onto.astype(np.float32))
    points = cv2.perspectiveTransform(cut.hull[None], found)[0]
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    scale = np.sqrt(abs(np.linalg.det(matrix)))
    colours = cut.image if channels is None else cut.image[..., channels]
    if scale < 0.55:
        colours = cv2.GaussianBlur(colours, (0, 0), 0.45 / scale)
    layer = cv2.warpPerspective(colours, np.linalg.inv(half) @ found @ half, (pixels, pixels))
    if bent and rng.random() < 0.5:
        bend = Bend(rng, rng.uniform(0.5, 2.5), pixels)
        layer, points = bend.image(layer), bend.points(points)
    return blended(image, layer, gain), box_of(points)


def blended(image, layer, gain):
    """A layer with transparency over a picture."""
    alpha = layer[..., 3:].astype(np.float32) * (1 / 255)
    colour = np.minimum(layer[..., :3] * np.float32(gain), 255)
    return (image * (1 - alpha) + colour * alpha).astype(np.uint8)


CHANNELS = ([1, 2, 0, 3], [2, 0, 1, 3], [2, 1, 0, 3], [0, 2, 1, 3])


def with_others(store, rng, window, number, group, motion, box):
    """Puts other things into a window: of the same photograph, the target in other colours, or
    anything."""
    for _ in range(int(rng.choice([0, 1, 2, 3], p=[0.4, 0.3, 0.2, 0.1]))):
        chance, channels = rng.random(), None
        if chance < 0.5:
            alike = store.groups[group]
            chosen = alike[rng.integers(len(alike))]
        elif chance < 0.75:
            chosen, channels = number, CHANNELS[rng.integers(len(CHANNELS))]
        else:
            chosen = int(rng.integers(len(store.cuts)))
        place = free_place(rng, motion.place, box)
        if place is None or (chosen == number and channels is None):
            continue
        cut = store.cuts[chosen]
        scale = TEMPLATE / context_side(*np.ptp(cut.hull, axis=0))
        scale *= motion.scale * np.exp(rng.normal(0, 0.2))
        matrix = linear(scale, rng.normal(0, 0.2), 1, 0)
        gain = np.exp(rng.normal(0, 0.1))
        window, _ = paste(window, cut, matrix, place, rng, 0.05, gain, channels=channels)
    return window


def free_place(rng, target, box):
    """A place away from the target; nothing if none was found."""
    for _ in range(6):
        place = rng.uniform(6, SEARCH - 6, 2)
        if np.abs(place - target).max() <= 26:
            continue
        if box is not None and np.maximum(box[:2] - place, place - box[2:]).max() < 8:
            continue
        return place
    return None


def covered(store, rng, window, box):
    """Now and then, something before a part of the target."""
    if rng.random() > 0.14:
        return window
    share, side = rng.uniform(0.2, 0.5), int(rng.integers(4))
    cover = box + np.array([-1, -1, 1, 1]) * rng.uniform(0, 12, 4)
    axis = side % 2
    edge = box[axis] + share * (box[axis + 2] - box[axis])
    if side < 2:
        cover[axis + 2] = edge
    else:
        cover[axis] = box[axis] + box[axis + 2] - edge
    left, top, right, bottom = np.clip(np.rint(cover), 0, SEARCH).astype(int)
    if right <= left + 1 or bottom <= top + 1:
        return window
    other = Scene.random(store, rng, SEARCH).seen(store, rng, SEARCH)
    window = window.copy()
    window[top:bottom, left:right] = other[top:bottom, left:right]
    return window
