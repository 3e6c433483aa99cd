"""Draws models: triangles with textures, a depth for each pixel, and one lamp."""

from dataclasses import dataclass, replace

import cv2
import numba
import numpy as np

from .geometry import SEARCH, TEMPLATE, context_side

# Pixels drawn for each pixel of the picture, along a side.
FINER = 2
SMALLEST = 6


@dataclass
class Pose:
    """How a model stands, which frame of its motion it shows, and the light."""

    frame: int
    # Turned around the upright axis, tilted to the camera, and leaning.
    turn: float
    tilt: float
    lean: float
    lamp: np.ndarray
    # Share of the light that comes from everywhere.
    dim: float
    perspective: float
    # Pixels for each unit of the model; 0 until it is placed.
    scale: float = 0.0


def poses(rng, model):
    """Two poses of a model, as a moment apart."""
    frames = len(model.points)
    above = rng.random() < 0.15
    first = Pose(
        frame=int(rng.integers(frames)),
        turn=rng.uniform(0, 2 * np.pi),
        tilt=rng.uniform(0.7, 1.4) if above else rng.normal(0.3, 0.2),
        lean=rng.normal(0, 0.1),
        lamp=lamp(rng),
        dim=rng.uniform(0.35, 0.9),
        perspective=rng.uniform(0, 0.4),
    )
    turned = rng.normal(0, 0.5) if rng.random() < 0.85 else rng.normal(0, 1.2)
    second = replace(
        first,
        frame=int(rng.integers(frames)),
        turn=first.turn + turned,
        tilt=first.tilt + rng.normal(0, 0.15),
        lean=first.lean + rng.normal(0, 0.12) + (rng.normal(0, 0.6) if above else 0),
        lamp=first.lamp if rng.random() < 0.7 else lamp(rng),
    )
    return first, second


def lamp(rng):
    direction = rng.normal(0, 1, 3) + [0, -0.8, -1]
    return direction / np.linalg.norm(direction)


def stood(model, pose):
    """The points in the camera's directions: right, down, away; the largest side is 1."""
    points = model.points[pose.frame].astype(np.float64)
    points = (points - (points.max(0) + points.min(0)) / 2) * [1, -1, 1] / model.size
    for angle, (a, b) in ((pose.turn, (0, 2)), (pose.tilt, (1, 2)), (pose.lean, (0, 1))):
        cos, sin = np.cos(angle), np.sin(angle)
        first, second = points[:, a].copy(), points[:, b].copy()
        points[:, a], points[:, b] = cos * first - sin * second, sin * first + cos * second
    points[:, :2] /= 1 + pose.perspective * points[:, 2:]
    return points


def placed(image, model, pose, scale, place):
    """A picture with a model whose middle is at `place`, and the box of what is seen of it:
    nothing if that is too little. Without a scale it gets that of a template."""
    points = stood(model, pose)
    used = points[model.triangles.ravel(), :2]
    low, high = used.min(0), used.max(0)
    size = high - low
    if scale is None:
        scale = pose.scale = TEMPLATE / context_side(*size) / model.size
    pixels = scale * model.size
    if min(size) * pixels < SMALLEST or max(size) * pixels > 2 * SEARCH:
        return image, None
    corner = np.floor(place - size * pixels / 2).astype(int) - 1
    width, height = (np.ceil(size * pixels).astype(int) + 3).tolist()
    points[:, :2] = (points[:, :2] - (low + high) / 2) * pixels + place - corner
    layer = drawn(model, pose, points, width, height)
    return over(image, layer, corner)


def drawn(model, pose, points, width, height):
    """The model on a transparent layer."""
    points = points * [FINER, FINER, 1]
    layer = np.zeros((height * FINER, width * FINER, 4), np.float32)
    fill(
        points,
        model.texture_points,
        model.triangles,
        model.of_texture,
        model.textures,
        pose.lamp,
        pose.dim,
        layer,
    )
    return cv2.resize(layer, (width, height), interpolation=cv2.INTER_AREA)


def over(image, layer, corner):
    """A layer over a picture, and the box of its solid pixels."""
    solid = layer[..., 3] > 0.5
    rows, columns = np.where(solid.any(1))[0], np.where(solid.any(0))[0]
    if len(rows) < SMALLEST or len(columns) < SMALLEST:
        return image, None
    box = np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], float)
    box += np.tile(corner, 2)
    start = np.maximum(corner, 0)
    end = np.minimum(corner + layer.shape[1::-1], image.shape[1::-1])
    if (end <= start).any():
        return image, None
    inside = layer[start[1] - corner[1] : end[1] - corner[1]]
    inside = inside[:, start[0] - corner[0] : end[0] - corner[0]]
    image = image.copy()
    part = image[start[1] : end[1], start[0] : end[0]]
    # The colours are already scaled by how solid the pixel is.
    part[:] = part * (1 - inside[..., 3:]) + inside[..., :3]
    return image, box


@numba.njit(cache=True)
def fill(points, texture_points, triangles, of_texture, textures, lamp, dim, layer):
    """Fills the triangles into the layer, the nearest in front."""
    height, width = layer.shape[:2]
    depth = np.full((height, width), np.inf)
    side = textures.shape[1]
    for number in range(len(triangles)):
        a, b, c = triangles[number]
        ax, ay, az = points[a]
        bx, by, bz = points[b]
        cx, cy, cz = points[c]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-9:
            continue
        light = shade(points[a], points[b], points[c], lamp, dim)
        texture = textures[of_texture[number]]
        first_row = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        last_row = min(height - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        first_column = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        last_column = min(width - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        for row in range(first_row, last_row + 1):
            y = row + 0.5
            for column in range(first_column, last_column + 1):
                x = column + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                z = u * az + v * bz + w * cz
                if z >= depth[row, column]:
                    continue
                s = u * texture_points[a, 0] + v * texture_points[b, 0] + w * texture_points[c, 0]
                t = u * texture_points[a, 1] + v * texture_points[b, 1] + w * texture_points[c, 1]
                across = int((s - np.floor(s)) * side) % side
                down = int((1 - (t - np.floor(t))) * side) % side
                if texture[down, across, 3] < 128:
                    continue
                depth[row, column] = z
                for k in range(3):
                    layer[row, column, k] = min(255.0, texture[down, across, k] * light)
                layer[row, column, 3] = 1


@numba.njit(cache=True)
def shade(a, b, c, lamp, dim):
    """How bright a triangle is, from either side."""
    nx = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    ny = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    nz = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    length = np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-12
    # The side that the camera sees looks against its direction.
    if nz > 0:
        length = -length
    towards = (nx * lamp[0] + ny * lamp[1] + nz * lamp[2]) / length
    return dim + (1.15 - dim) * max(0.0, towards)
