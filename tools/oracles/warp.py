"""warp.json: affine sampling of a small image, by OpenCV and by SciPy.

OpenCV 4 quantises sample positions to 1/32 px in `warpAffine` and `remap` with INTER_LINEAR, for 8-bit and
float images; OpenCV 5 does not. So the file has two parts:

- `exact`: maps whose sample positions are all multiples of 1/32 px, by `cv2.warpAffine`. The image contains
  multiples of 1/256, so every product and sum is exact in f32, and results must be equal to the last bit;
- `general`: any map, by `scipy.ndimage.map_coordinates` in f64. The mode is `grid-constant`, which
  interpolates with zeros outside the frame. The mode `constant` would give 0 for any position outside.
"""

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

import golden

WIDTH, HEIGHT, SIDE = 40, 30, 32
OFFSETS = np.arange(SIDE) - (SIDE - 1) / 2
# x, y, s, theta, r, phi: centre (0-based, pixel centres at integers), scale, rotation, aspect, skew.
EXACT_STATES = [
    (19.5, 14.5, 0.5, 0.0, 1.0, 0.0),
    (20.0, 15.0, 0.75, 0.0, 1.0, 0.0),
    (18.03125, 13.71875, 0.875, 0.0, 0.5, 0.0),
    (4.5, 25.25, 1.0, 0.0, 1.0, 0.0),
    (36.34375, 2.09375, 1.5, 0.0, 0.75, 0.0),
]
EXACT_MATRICES = [
    ((0.8125, 0.1875, 19.03125), (-0.125, 0.75, 14.5)),
    ((0.5, -0.625, 30.25), (0.625, 0.5, 8.96875)),
]
GENERAL_STATES = [
    (19.3, 14.6, 0.61, 0.0, 0.9, 0.0),
    (20.71, 13.37, 0.8, 0.31, 0.85, 0.0),
    (17.9, 15.2, 0.47, -1.2, 1.4, 0.0),
    (1.3, 2.7, 0.93, 0.12, 1.1, 0.0),
    (38.8, 28.1, 1.21, -0.4, 0.7, 0.0),
    (20.2, 14.1, 0.7, 0.25, 1.3, 0.35),
    (9.4, 22.9, 1.05, -0.6, 0.6, -0.8),
    (-60.0, 12.0, 1.0, 0.3, 1.0, 0.1),
]


def image() -> np.ndarray:
    """Smooth blobs and noise in [0, 1], in steps of 1/256."""
    rng = np.random.default_rng(1)
    smooth = gaussian_filter(rng.normal(size=(HEIGHT, WIDTH)), 3.0)
    smooth = (smooth - smooth.min()) / np.ptp(smooth)
    noisy = 0.8 * smooth + 0.1 + rng.normal(scale=0.05, size=smooth.shape)
    return np.round(np.clip(noisy, 0.0, 1.0) * 256) / 256


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def matrix(state: tuple[float, ...]) -> np.ndarray:
    """R(theta) R(-phi) S R(phi) with the centre as third column; it acts on (a, b) in -15.5 .. 15.5."""
    x, y, s, theta, r, phi = state
    linear = rotation(theta) @ rotation(-phi) @ np.diag([s, s * r]) @ rotation(phi)
    if phi == 0.0:  # avoids the rounding of products with R(0)
        linear = rotation(theta) @ np.diag([s, s * r])
    return np.column_stack([linear, [x, y]])


def positions(m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b = np.meshgrid(OFFSETS, OFFSETS)
    return m[0, 0] * a + m[0, 1] * b + m[0, 2], m[1, 0] * a + m[1, 1] * b + m[1, 2]


def by_scipy(img: np.ndarray, m: np.ndarray) -> np.ndarray:
    x, y = positions(m)
    return map_coordinates(img, [y, x], order=1, mode="grid-constant", cval=0.0)


def by_opencv(img: np.ndarray, m: np.ndarray) -> np.ndarray:
    """OpenCV counts output pixels from 0, so the map is first shifted to the corner of the grid."""
    corner = m[:, :2] @ [OFFSETS[0], OFFSETS[0]] + m[:, 2]
    return cv2.warpAffine(
        img.astype(np.float32),
        np.column_stack([m[:, :2], corner]),
        (SIDE, SIDE),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=0.0,
    )


def case(state: tuple[float, ...] | None, m: np.ndarray, output: list) -> dict:
    return {
        "state": None if state is None else golden.f64s(state),
        "matrix": golden.f64s(m),
        "output": output,
    }


def exact_case(img: np.ndarray, state: tuple[float, ...] | None, m: np.ndarray) -> dict:
    for p in positions(m):
        assert np.all(p * 32 == np.round(p * 32)), "a position is not a multiple of 1/32"
    output = by_opencv(img, m)
    assert np.array_equal(output, by_scipy(img, m)), "OpenCV and SciPy differ"
    return case(state, m, golden.f32s(output))


def general_case(img: np.ndarray, state: tuple[float, ...]) -> tuple[dict, float]:
    m = matrix(state)
    output = by_scipy(img, m)
    return case(state, m, golden.f64s(output, 10)), float(abs(by_opencv(img, m) - output).max())


def main() -> None:
    cv2.setNumThreads(1)
    img = image()
    exact = [exact_case(img, s, matrix(s)) for s in EXACT_STATES]
    exact += [exact_case(img, None, np.array(m)) for m in EXACT_MATRICES]
    general, differences = zip(*(general_case(img, s) for s in GENERAL_STATES))
    head = golden.header(
        ["opencv-contrib-python-headless", "scipy", "numpy"],
        "Bilinear samples of `image` at matrix * (a, b, 1), a and b in -15.5..15.5, rows of output along b; "
        "samples outside the frame are 0. `exact` by cv2.warpAffine (equal to the last bit), `general` by "
        "map_coordinates(order=1, mode='grid-constant') in f64, 10 digits.",
        opencv_against_scipy_on_general_maps=max(differences),
    )
    golden.write(
        "warp.json",
        {
            "header": head,
            "width": WIDTH,
            "height": HEIGHT,
            "image": golden.f32s(img),
            "exact": exact,
            "general": list(general),
        },
    )


if __name__ == "__main__":
    main()
