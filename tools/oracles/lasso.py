"""lasso.json: min ||y - U q - e||^2 / 2 + lambda (||q||_1 + ||e||_1), by scikit-learn and SPAMS.

The two must agree. Both solve one lasso over the dictionary [U, I]. scikit-learn divides the objective by the
number of rows; SPAMS does not.
"""

import warnings

import numpy as np
import spams
from sklearn.linear_model import Lasso

import golden

ROWS, COLUMNS, LAMBDA = 200, 8, 0.01
AGREEMENT = 1e-7


def problem(
    rng: np.random.Generator, noise: float, outliers: int, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """A signal in the subspace with noise and outliers in a few entries, and the orthonormal basis."""
    u = golden.as_f32(np.linalg.qr(rng.normal(size=(ROWS, COLUMNS)))[0])
    q = rng.normal(scale=0.5, size=COLUMNS) * (rng.random(COLUMNS) < 0.7)
    y = u @ q + rng.normal(scale=noise, size=ROWS)
    hit = rng.choice(ROWS, outliers, replace=False)
    y[hit] += size * rng.normal(size=outliers)
    return golden.as_f32(y), u


def by_sklearn(y: np.ndarray, u: np.ndarray) -> np.ndarray:
    dictionary = np.hstack([u, np.eye(ROWS)])
    model = Lasso(alpha=LAMBDA / ROWS, fit_intercept=False, tol=1e-12, max_iter=1_000_000)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.fit(dictionary, y)
    return model.coef_


def by_spams(y: np.ndarray, u: np.ndarray) -> np.ndarray:
    dictionary = np.asfortranarray(np.hstack([u, np.eye(ROWS)]))
    code = spams.lasso(np.asfortranarray(y[:, None]), dictionary, lambda1=LAMBDA, mode=2, numThreads=1)
    return code.toarray()[:, 0]


def objective(y: np.ndarray, u: np.ndarray, w: np.ndarray) -> float:
    q, e = w[:COLUMNS], w[COLUMNS:]
    return 0.5 * np.sum((y - u @ q - e) ** 2) + LAMBDA * np.sum(np.abs(w))


def case(rng: np.random.Generator, noise: float, outliers: int, size: float) -> tuple[dict, float]:
    y, u = problem(rng, noise, outliers, size)
    w, other = by_sklearn(y, u), by_spams(y, u)
    difference = float(abs(w - other).max())
    assert difference < AGREEMENT, f"scikit-learn and SPAMS differ by {difference}"
    return {
        "y": golden.f32s(y),
        "u": golden.f32s(u),
        "q": golden.f64s(w[:COLUMNS], 12),
        "e": golden.f64s(w[COLUMNS:], 12),
        "objective": golden.f64s(objective(y, u, w), 12),
    }, difference


def main() -> None:
    rng = np.random.default_rng(4)
    settings = [
        (0.002, 0, 0.0),
        (0.005, 10, 0.3),
        (0.005, 40, 0.3),
        (0.02, 20, 1.0),
        (0.001, 80, 0.1),
        (0.05, 5, 3.0),
    ]
    cases, differences = zip(*(case(rng, *s) for s in settings))
    head = golden.header(
        ["scikit-learn", "spams-bin", "numpy"],
        "min ||y - U q - e||^2 / 2 + lambda (||q||_1 + ||e||_1). q, e by scikit-learn's Lasso on [U, I]; "
        "SPAMS's lasso (mode 2) agrees.",
        scikit_learn_against_spams_max_difference=max(differences),
    )
    golden.write(
        "lasso.json",
        {"header": head, "rows": ROWS, "columns": COLUMNS, "lambda": LAMBDA, "cases": list(cases)},
    )


if __name__ == "__main__":
    main()
