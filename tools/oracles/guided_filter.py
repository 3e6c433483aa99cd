"""guided_filter.json: the guided filter of He, Sun and Tang, computed from its definition, window by window.

Windows are clipped at the borders and averaged over the pixels that they contain.
`cv2.ximgproc.guidedFilter` mirrors the image at the borders instead, so it is compared only in the interior;
the header records the largest difference there.
"""

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

import golden

SIDE, RADIUS, EPS = 32, 2, 0.01
# At this distance from the border no clipped window affects a pixel, not even through neighbouring windows.
INTERIOR = slice(2 * RADIUS, SIDE - 2 * RADIUS)


def window(centre: int) -> slice:
    return slice(max(0, centre - RADIUS), min(SIDE, centre + RADIUS + 1))


def guided_filter(guide: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Fits p by a*guide + b in each window, with ridge eps on a; a pixel gets the mean fit of its windows."""
    a, b = np.empty_like(p), np.empty_like(p)
    for y, x in np.ndindex(p.shape):
        i_w, p_w = guide[window(y), window(x)], p[window(y), window(x)]
        covariance = np.mean((i_w - i_w.mean()) * (p_w - p_w.mean()))
        a[y, x] = covariance / (i_w.var() + EPS)
        b[y, x] = p_w.mean() - a[y, x] * i_w.mean()
    out = np.empty_like(p)
    for y, x in np.ndindex(p.shape):
        out[y, x] = a[window(y), window(x)].mean() * guide[y, x] + b[window(y), window(x)].mean()
    return out


def visibility(kappas: np.ndarray) -> np.ndarray:
    """The mean, at each pixel, of the levels of the 16x16 patches (step 8) that cover it."""
    total, count = np.zeros((SIDE, SIDE)), np.zeros((SIDE, SIDE))
    for row, column in np.ndindex(3, 3):
        area = (slice(8 * row, 8 * row + 16), slice(8 * column, 8 * column + 16))
        total[area] += kappas[row, column]
        count[area] += 1
    return total / count


def unit_range(a: np.ndarray) -> np.ndarray:
    return (a - a.min()) / np.ptp(a)


def inputs(rng: np.random.Generator) -> list[tuple[str, np.ndarray, np.ndarray]]:
    noise = rng.random((SIDE, SIDE))
    smooth = unit_range(gaussian_filter(rng.normal(size=(SIDE, SIDE)), 3.0))
    y, x = np.mgrid[:SIDE, :SIDE]
    step = (x + 0.5 * y > 24).astype(float)
    levels = visibility(np.array([[1, 1, 0], [1, 0, 0], [1, 1, 0]], dtype=float))
    return [
        ("random guide, random input", noise, rng.random((SIDE, SIDE))),
        ("smooth guide, random input", smooth, rng.random((SIDE, SIDE))),
        ("step guide, noisy step input", step, step + rng.normal(scale=0.1, size=step.shape)),
        (
            "noisy step guide, visibility input",
            unit_range(step + rng.normal(scale=0.1, size=step.shape)),
            levels,
        ),
        ("smooth guide, visibility input", smooth, levels),
        ("guide filters itself", unit_range(smooth + 0.2 * noise), unit_range(smooth + 0.2 * noise)),
        ("constant guide", np.full((SIDE, SIDE), 0.5), levels),
    ]


def case(name: str, guide: np.ndarray, p: np.ndarray) -> tuple[dict, float]:
    guide, p = golden.as_f32(guide), golden.as_f32(p)
    out = guided_filter(guide, p)
    other = cv2.ximgproc.guidedFilter(guide.astype(np.float32), p.astype(np.float32), RADIUS, EPS)
    difference = float(abs(other - out)[INTERIOR, INTERIOR].max())
    return {
        "name": name,
        "guide": golden.f32s(guide),
        "input": golden.f32s(p),
        "output": golden.f64s(out, 10),
    }, difference


def main() -> None:
    cv2.setNumThreads(1)
    cases, differences = zip(*(case(*i) for i in inputs(np.random.default_rng(3))))
    assert max(differences) < 1e-5, "OpenCV disagrees in the interior"
    head = golden.header(
        ["numpy", "scipy", "opencv-contrib-python-headless"],
        "He's guided filter of `input` with `guide`, box windows clipped at the borders with their true "
        "counts, brute force in f64, 10 digits.",
        opencv_ximgproc_max_difference_in_interior=max(differences),
    )
    golden.write(
        "guided_filter.json",
        {"header": head, "side": SIDE, "radius": RADIUS, "eps": EPS, "cases": list(cases)},
    )


if __name__ == "__main__":
    main()
