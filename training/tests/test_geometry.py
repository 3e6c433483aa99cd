"""The box that a pair states is the box of what the picture shows."""

import cv2
import numpy as np
import pytest

from training import geometry, models, pairs, render
from training.objects import hull
from training.store import Cut, Segment, Store

SEEDS = range(20)


def shown(image):
    """The box of the white pixels."""
    rows, columns = np.where(image[..., 0] > 127)
    return np.array([columns.min(), rows.min(), columns.max() + 1, rows.max() + 1])


def ellipse(height, width):
    mask = np.zeros((height, width), np.uint8)
    middle = (width // 2, height // 2)
    cv2.ellipse(mask, middle, (width // 2 - 4, height // 2 - 4), 0, 0, 360, 1, -1)
    return mask


@pytest.mark.parametrize("seed", SEEDS)
def test_a_pasted_cut_has_the_box_of_its_mask(seed):
    rng = np.random.default_rng(seed)
    mask = ellipse(40, 56)
    cut = Cut(np.dstack([mask * 255] * 4), hull(mask), 0)
    motion = pairs.Motion.random(rng)
    black = np.zeros((128, 128, 3), np.uint8)
    place = np.clip(motion.place, 40, 88)
    image, box = pairs.paste(black, cut, motion.matrix, place, rng, 0.06, 1.0, bent=True)
    assert np.abs(box - shown(image)).max() < 2


@pytest.mark.parametrize("seed", SEEDS)
def test_a_segment_that_moves_has_the_box_of_its_mask(seed):
    rng = np.random.default_rng(seed)
    photograph = np.zeros((300, 400, 3), np.uint8)
    photograph[100:160, 150:230] = ellipse(60, 80)[..., None] * 255
    outline = hull((photograph[..., 0] > 0).astype(np.uint8))
    store = Store([photograph], [], []).prepare()
    motion = pairs.Motion.random(rng)
    box = geometry.box_of(outline)
    centre = (box[:2] + box[2:]) / 2
    matrix = motion.matrix * geometry.TEMPLATE / geometry.context_side(*(box[2:] - box[:2]))
    image = pairs.view(store, 0, matrix, centre, [64, 64], 128)
    points = (outline - centre) @ matrix.T + 64
    bend = geometry.Bend(rng, 2)
    assert np.abs(geometry.box_of(points) - shown(image)).max() < 2
    bent = bend.points(points.astype(np.float32))
    assert np.abs(geometry.box_of(bent) - shown(bend.image(image))).max() < 2.5


@pytest.mark.parametrize("seed", SEEDS)
def test_a_model_has_the_box_of_its_pixels(seed):
    rng = np.random.default_rng(seed)
    model = cube()
    first, second = render.poses(rng, model)
    black = np.zeros((128, 128, 3), np.uint8)
    image, box = render.placed(black, model, first, None, [64, 64])
    assert np.abs(box - shown((image > 0) * np.uint8(255))).max() <= 1
    side = geometry.context_side(*(box[2:] - box[:2]))
    assert abs(side - geometry.TEMPLATE) < 6
    image, box = render.placed(black, model, second, first.scale, [30, 70])
    assert np.abs((box[:2] + box[2:]) / 2 - [30, 70]).max() < 1.5


def cube():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    triangles = [[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4]]
    triangles += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 3, 7], [1, 7, 5]]
    texture = np.full((1, models.TEXTURE, models.TEXTURE, 4), 255, np.uint8)
    return models.Model(
        "cubes",
        corners[None].astype(np.float16),
        corners[:, :2].astype(np.float32),
        np.array(triangles, np.int32),
        np.zeros(len(triangles), np.int32),
        texture,
    )


def test_a_window_shows_the_pixels_around_its_centre():
    image = np.arange(40 * 60, dtype=np.uint8).reshape(40, 60, 1).repeat(3, 2)
    cut = geometry.window(image, [20, 16], 8, 8, [0, 0, 0])
    assert (cut == image[12:20, 16:24]).all()
    outside = geometry.window(image, [0, 0], 8, 8, [9, 9, 9])
    assert (outside[:4] == 9).all() and (outside[4:, 4:] == image[:4, :4]).all()


def small_store():
    """Photographs of noise with a segment each, and a model."""
    rng = np.random.default_rng(0)
    photographs = [rng.integers(0, 255, (200, 260, 3), dtype=np.uint8) for _ in range(3)]
    mask = ellipse(40, 56)
    segments, cuts = [], []
    for number, image in enumerate(photographs):
        segments.append(Segment(number, hull(mask) + [80, 60], number))
        cuts.append(Cut(np.dstack([image[60:100, 80:136], mask * 255]), hull(mask), number))
    cuts.append(Cut(np.dstack([photographs[0][:40, :56], mask * 255]), hull(mask), -1))
    return Store(photographs, segments, cuts, [cube()])


def test_a_pair_depends_on_its_number_alone():
    store = small_store().prepare()
    for number in range(20):
        pair, again = (pairs.make(store, 7, number) for _ in range(2))
        assert (pair.template == again.template).all() and (pair.window == again.window).all()
        assert (pair.box == again.box).all()
    boxes = [pairs.make(store, 7, number).box for number in range(200)]
    assert all(not box.any() or pairs.is_seen(box) for box in boxes)
    assert 1 <= sum(not box.any() for box in boxes) <= 20
