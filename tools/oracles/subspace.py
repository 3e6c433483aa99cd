"""subspace.json: mean, singular values and projections by one batch SVD of all columns so far.

An incremental SVD with mean update and forgetting factor 1 must give the same result after every batch if it
does not truncate: its limit on eigenvectors must be at least `max_rank` of the sequence.
"""

import numpy as np

import golden

DIMENSION = 60
# The tracker drops singular values whose square is below this share of the total. The data avoid values near
# this limit.
RANK_SHARE = 1e-6


def spread(rng: np.random.Generator, columns: int, rank: int) -> np.ndarray:
    """Columns around a common mean, in an affine space of the given dimension."""
    basis = rng.normal(size=(DIMENSION, rank)) * np.linspace(1.0, 0.2, rank)
    return basis @ rng.normal(size=(rank, columns))


def sequences(rng: np.random.Generator) -> list[tuple[str, list[np.ndarray]]]:
    mean = rng.normal(size=(DIMENSION, 1))
    full = [mean + spread(rng, n, DIMENSION) for n in (10, 5, 5)]
    drifting = [mean + 0.5 * k + spread(rng, n, DIMENSION) for k, n in enumerate((10, 5, 5, 5, 5))]
    # All batches lie in one affine space of dimension 3: later batches add energy, but no new directions.
    low = np.split(mean + spread(rng, 25, 3), [10, 15, 20], axis=1)
    # A batch of one column repeated five times, then one that only repeats columns of the first batch.
    first = mean + spread(rng, 10, DIMENSION)
    repeated = [first, np.repeat(mean + spread(rng, 1, DIMENSION), 5, axis=1), first[:, [0, 3, 3, 7, 9]]]
    # The first batch is one column repeated ten times, so the subspace starts with rank 0.
    constant = [np.repeat(mean, 10, axis=1), mean + spread(rng, 5, DIMENSION)]
    return [
        ("full rank", full),
        ("drifting mean", drifting),
        ("low rank", low),
        ("repeated columns", repeated),
        ("constant first batch", constant),
    ]


def decompose(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, left singular vectors and singular values, without numerical zeros."""
    mean = columns.mean(axis=1)
    u, values, _ = np.linalg.svd(columns - mean[:, None], full_matrices=False)
    energy = values**2
    total = max(energy.sum(), 1e-20)
    kept = energy >= RANK_SHARE * total
    assert np.all(energy[kept] > 100 * RANK_SHARE * total) and np.all(
        energy[~kept] < 1e-6 * RANK_SHARE * total
    ), "rank is a close call"
    return mean, u[:, kept], values[kept]


def after_batch(seen: np.ndarray, batch: np.ndarray, probes: np.ndarray) -> dict:
    mean, u, values = decompose(seen)
    return {
        "columns": golden.f32s(batch.T),
        "mean": golden.f64s(mean, 12),
        "singular_values": golden.f64s(values, 12),
        "projections": golden.f64s((u @ (u.T @ probes)).T, 12),
    }


def run(name: str, batches: list[np.ndarray], probes: np.ndarray) -> dict:
    batches = [golden.as_f32(b) for b in batches]
    steps = [after_batch(np.hstack(batches[: i + 1]), b, probes) for i, b in enumerate(batches)]
    return {"name": name, "max_rank": max(len(s["singular_values"]) for s in steps), "batches": steps}


def main() -> None:
    rng = np.random.default_rng(2)
    probes = golden.as_f32(rng.normal(size=(DIMENSION, 3)))
    head = golden.header(
        ["numpy"],
        "After each batch: mean of all columns so far, singular values of the columns minus that mean (zeros "
        "dropped), and U U^T p for the probes p, from one batch SVD in f64. No forgetting, no truncation.",
    )
    runs = [run(name, batches, probes) for name, batches in sequences(rng)]
    golden.write(
        "subspace.json",
        {"header": head, "dimension": DIMENSION, "probes": golden.f32s(probes.T), "sequences": runs},
    )


if __name__ == "__main__":
    main()
