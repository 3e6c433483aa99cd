"""Reads animated models of the game MegaGlest (format G3D, version 4)."""

import struct
import zlib
from dataclasses import dataclass

import cv2
import numpy as np

from .pictures import read
from .sources import chosen

TEXTURE = 128
FRAMES = 10
MOST_POINTS = 6000
# Bits of a mesh's properties and textures.
TEAM_COLOUR = 1
DIFFUSE = 1


@dataclass
class Model:
    """A thing of triangles that moves: the points of each frame, in its own units."""

    group: str
    points: np.ndarray
    # For each point, the place in its texture.
    texture_points: np.ndarray
    triangles: np.ndarray
    # For each triangle, the number of its texture.
    of_texture: np.ndarray
    textures: np.ndarray

    @property
    def size(self):
        """Its largest side."""
        return float(np.ptp(self.points[0].astype(np.float32), axis=0).max())


def models(work):
    """The models of all sources. Those of a folder above the unit's are alike."""
    for _, path in chosen(work, "models"):
        if (model := load(path)) is not None:
            yield model


def load(path):
    """A model; nothing if it is too large or has a mesh without a texture."""
    data = path.read_bytes()
    if data[:4] != b"G3D\x04":
        return None
    count, _ = struct.unpack_from("<HB", data, 4)
    at, meshes = 7, []
    for _ in range(count):
        mesh, at = read_mesh(data, at, path)
        if mesh is None:
            return None
        meshes.append(mesh)
    if not meshes or sum(mesh[0].shape[1] for mesh in meshes) > MOST_POINTS:
        return None
    return joined(group_of(path), meshes)


def group_of(path):
    """The faction or landscape that a model belongs to."""
    parts = path.parts
    for above in ("units", "models"):
        if above in parts:
            return "/".join(parts[: parts.index(above)][-2:])
    return parts[-2]


def read_mesh(data, at, path):
    """Points by frame, places in the texture, triangles, texture; and where the next mesh is."""
    frames, points, indices = struct.unpack_from("<3I", data, at + 64)
    properties, textures = struct.unpack_from("<2I", data, at + 108)
    at += 116
    name = data[at : at + 64].split(b"\0")[0].decode("latin-1")
    at += 64 * textures.bit_count()
    length = frames * points * 3
    shape = (frames, points, 3)
    places = np.frombuffer(data, "<f4", length, at).reshape(shape)
    at += 2 * 4 * length
    if not textures & DIFFUSE:
        return None, at
    on_texture = np.frombuffer(data, "<f4", 2 * points, at).reshape(points, 2)
    at += 8 * points * textures.bit_count()
    triangles = np.frombuffer(data, "<u4", indices, at).reshape(-1, 3)
    image = read_texture(path.parent / name, properties & TEAM_COLOUR)
    if image is None:
        return None, at + 4 * indices
    return (places, on_texture, triangles, image), at + 4 * indices


def read_texture(path, team):
    """A texture of a fixed size. Where it lets the colour of a team through, it gets one."""
    image = read(path, "RGBA", 1 << 14) if path.is_file() else None
    if image is None:
        return None
    image = cv2.resize(image, (TEXTURE, TEXTURE), interpolation=cv2.INTER_AREA)
    if team:
        rng = np.random.default_rng(zlib.crc32(path.name.encode()))
        alpha = image[..., 3:].astype(np.float32) / 255
        colour = rng.uniform(20, 235, 3)
        image[..., :3] = image[..., :3] * alpha + colour * (1 - alpha)
        image[..., 3] = 255
    return image


def joined(group, meshes):
    """Meshes as one model, with at most `FRAMES` of their frames."""
    frames = min(FRAMES, max(mesh[0].shape[0] for mesh in meshes))
    points, before = [], 0
    triangles, of_texture = [], []
    for number, (places, _, corners, _) in enumerate(meshes):
        chosen_frames = np.linspace(0, len(places) - 1, frames).round().astype(int)
        points.append(places[chosen_frames])
        triangles.append(corners + before)
        of_texture.append(np.full(len(corners), number))
        before += places.shape[1]
    points = np.concatenate(points, 1)
    if not np.isfinite(points).all() or np.ptp(points[0], axis=0).max() < 1e-3:
        return None
    return Model(
        group,
        points.astype(np.float16),
        np.concatenate([mesh[1] for mesh in meshes]).astype(np.float32),
        np.concatenate(triangles).astype(np.int32),
        np.concatenate(of_texture).astype(np.int32),
        np.stack([mesh[3] for mesh in meshes]),
    )
