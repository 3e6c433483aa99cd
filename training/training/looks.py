"""What cameras do to a picture: light, noise, blur, few pixels, one colour."""

from dataclasses import dataclass

import cv2
import numpy as np


@dataclass
class Appearance:
    """What template and window have in common, since one camera took both."""

    grey: bool
    # Grey as of a thermal camera: another tone for each brightness.
    tones: np.ndarray | None
    # Exponent of a dark or bright scene.
    gamma: float
    # How many times too few pixels there are; 0 for enough.
    coarse: float
    compressed: bool

    @classmethod
    def random(cls, rng):
        thermal = rng.random() < 0.06
        return cls(
            grey=thermal or rng.random() < 0.15,
            tones=tones(rng) if thermal else None,
            gamma=np.exp(rng.normal(0.5, 0.4)) if rng.random() < 0.12 else 1.0,
            coarse=rng.uniform(1.3, 4.0) if rng.random() < 0.3 else 0.0,
            compressed=rng.random() < 0.15,
        )


def tones(rng):
    """A smooth table of tones, which may fall where the other rises."""
    knots = np.cumsum(rng.normal(0, 1, 5))
    knots = (knots - knots.min()) / max(np.ptp(knots), 1e-3) * 255
    return np.interp(np.arange(256), np.linspace(0, 255, 5), knots).astype(np.uint8)


def taken(image, look, rng):
    """A picture as a camera takes it."""
    if look.grey:
        grey = image.mean(2, keepdims=True).astype(np.uint8)
        grey = grey if look.tones is None else look.tones[grey]
        image = np.repeat(grey, 3, axis=2)
    image = lit(image, look, rng)
    image = blurred(image, rng)
    if look.coarse > 1:
        pixels = image.shape[0]
        few = int(pixels / (look.coarse * rng.uniform(0.85, 1.15)))
        image = cv2.resize(image, (few, few), interpolation=cv2.INTER_AREA)
        image = cv2.resize(image, (pixels, pixels), interpolation=cv2.INTER_LINEAR)
    if rng.random() < 0.2:
        noise = rng.standard_normal(image.shape, dtype=np.float32) * rng.uniform(2, 9)
        image = np.clip(image + noise, 0, 255).astype(np.uint8)
    if look.compressed and rng.random() < 0.8:
        quality = int(rng.integers(25, 80))
        _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
        image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return image


def lit(image, look, rng):
    """Another brightness, contrast and colour of the light, by a table for each channel."""
    gain, offset = np.exp(rng.normal(0, 0.12)), rng.normal(0, 10)
    contrast, mean = np.exp(rng.normal(0, 0.12)), image.mean()
    gamma = look.gamma * (np.exp(rng.normal(0, 0.25)) if rng.random() < 0.25 else 1)
    tint = np.ones(3) if look.grey else np.exp(rng.normal(0, 0.05, 3))
    tone = ((np.arange(256) - mean) * contrast + mean)[:, None] * gain * tint + offset
    tone = 255 * (np.clip(tone, 0, 255) / 255) ** gamma
    return cv2.LUT(image, tone.astype(np.uint8)[None])


def blurred(image, rng):
    """Out of focus or moved, in one of five."""
    chance = rng.random()
    if chance < 0.12:
        return cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 1.3))
    if chance > 0.22:
        return image
    kernel = np.zeros((9, 9), np.float32)
    angle, length = rng.uniform(0, np.pi), rng.uniform(1, 4.4)
    x, y = (int(round(side * length)) for side in (np.cos(angle), np.sin(angle)))
    cv2.line(kernel, (4 - x, 4 - y), (4 + x, 4 + y), 1.0)
    return cv2.filter2D(image, -1, kernel / kernel.sum())
