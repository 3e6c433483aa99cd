"""Reads photographs and cut-outs, and leaves out what is neither."""

import cv2
import numpy as np
from PIL import Image

from .sources import chosen

LARGEST = 1024
CUTOUT = 144
PICTURES = (".jpg", ".jpeg", ".png", ".webp")
# Wallpapers of 8k pixels are meant to be read.
Image.MAX_IMAGE_PIXELS = None


def read(path, mode, largest):
    """A picture, shrunk to `largest`; nothing if it is none."""
    try:
        image = Image.open(path)
        image.draft(mode, (largest, largest))
        image = image.convert(mode)
    except (OSError, ValueError, SyntaxError):
        return None
    scale = largest / max(image.size)
    if scale < 1:
        size = [max(1, round(side * scale)) for side in image.size]
        image = image.resize(size, Image.Resampling.BOX)
    return np.ascontiguousarray(image)


def is_photograph(image):
    """Whether a picture has many colours and few areas of exactly one, unlike a drawing."""
    if min(image.shape[:2]) < 140:
        return False
    small = cv2.resize(image, (96, 96), interpolation=cv2.INTER_AREA)
    colours = (small >> 3).astype(np.int32) @ [1024, 32, 1]
    sample = image[:400, :400].astype(np.int16)
    flat = (np.abs(np.diff(sample, axis=1)).sum(2) == 0).mean()
    black, white = (image.max(2) == 0).mean(), (image.min(2) == 255).mean()
    return len(np.unique(colours)) > 350 and flat < 0.35 and black < 0.08 and white < 0.45


def is_normal_map(image):
    """Whether a texture holds directions, not colours."""
    red, _, blue = image.reshape(-1, 3).mean(0)
    return blue > red + 60 and blue > 200


def fingerprint(image):
    """Equal for copies of a picture at different sizes."""
    return (cv2.resize(image, (9, 9), interpolation=cv2.INTER_AREA)[..., 1] >> 4).tobytes()


def photographs(work):
    """The photographs of all sources, each once."""
    seen, kept = set(), []
    for source, path in chosen(work, "photos"):
        if path.suffix.lower() not in PICTURES:
            continue
        image = read(path, "RGB", LARGEST)
        if image is None or not is_photograph(image) or is_normal_map(image):
            continue
        key = fingerprint(image)
        if key not in seen:
            seen.add(key)
            kept.append((source.package, image))
    return kept


def cutouts(work):
    """Pictures of single things with a transparent surrounding, cropped to the thing."""
    kept = []
    for _, path in chosen(work, "cutouts"):
        image = read(path, "RGBA", 1 << 14) if path.suffix.lower() == ".png" else None
        if image is not None and (cut := cropped(image)) is not None:
            kept.append(cut)
    return kept


def cropped(image):
    """A cut-out without its empty border; nothing if it is tiny or a drawing of few colours."""
    solid = image[..., 3] > 128
    if solid.sum() < 900 or solid.all():
        return None
    rows, columns = np.where(solid)
    image = image[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    image = shrunk(image, CUTOUT)
    colours = (image[image[..., 3] > 128][:, :3] >> 4).astype(np.int32) @ [256, 16, 1]
    return image if min(image.shape[:2]) >= 16 and len(np.unique(colours)) >= 60 else None


def shrunk(image, largest):
    """A picture with transparency, at most `largest` on a side. Colours of transparent pixels do
    not bleed into others."""
    scale = largest / max(image.shape[:2])
    if scale >= 1:
        return np.ascontiguousarray(image)
    height, width = (max(4, round(side * scale)) for side in image.shape[:2])
    alpha = image[..., 3:].astype(np.float32) / 255
    mixed = np.dstack([image[..., :3] * alpha, image[..., 3:]]).astype(np.float32)
    mixed = cv2.resize(mixed, (width, height), interpolation=cv2.INTER_AREA)
    colours = mixed[..., :3] / np.maximum(mixed[..., 3:] / 255, 1e-3)
    return np.dstack([colours, mixed[..., 3:]]).clip(0, 255).astype(np.uint8)
