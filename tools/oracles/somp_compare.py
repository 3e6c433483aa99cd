"""Compares SPAMS with the numpy reference on single joint sparse coding problems, for a golden file."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import spams

import golden
import somp_reference
from somp_reference import Solution

LIMIT = 4
# Largest difference of coefficients between two f64 solvers with the same well-conditioned support. Nearly
# dependent atoms amplify rounding errors.
TOLERANCE = 1e-9


@dataclass(frozen=True)
class SpamsAnswer:
    """Atoms and their coefficients (atoms x signals).

    The atoms are in the order of selection if `ordered`, else in the order of SPAMS.
    """

    atoms: list[int]
    coefficients: np.ndarray
    ordered: bool


def spams_once(signals: np.ndarray, dictionary: np.ndarray, limit: int) -> tuple[list[int], np.ndarray]:
    code = spams.somp(
        np.asfortranarray(signals),
        np.asfortranarray(dictionary),
        np.array([0], dtype=np.int32),
        L=limit,
        eps=0.0,
        numThreads=1,
    )
    # Parsed here, since with dependent atoms the sparse matrix may contain an atom twice, or NaN.
    starts = code.indptr
    assert len(set(np.diff(starts))) == 1, "the signals of a group share their atoms"
    atoms = [int(a) for a in code.indices[: starts[1]]]
    return atoms, code.data.reshape(signals.shape[1], len(atoms)).T


def by_spams(signals: np.ndarray, dictionary: np.ndarray, limit: int = LIMIT) -> SpamsAnswer:
    """SPAMS sorts the atoms, but is greedy: runs with 1, 2, ... atoms reveal the order, as each adds one."""
    runs = [spams_once(signals, dictionary, k) for k in range(1, limit + 1)]
    order: list[int] = []
    for k, (atoms, _) in enumerate(runs, 1):
        order += [a for a in atoms if a not in order]
        if len(order) != k or sorted(order) != atoms:
            return SpamsAnswer(*runs[-1], ordered=False)
    atoms, coefficients = runs[-1]
    return SpamsAnswer(order, coefficients[[atoms.index(a) for a in order]], ordered=True)


def residual_energies(
    signals: np.ndarray, dictionary: np.ndarray, atoms: list[int], coefficients: np.ndarray
) -> np.ndarray:
    return np.sum((signals - dictionary[:, atoms] @ coefficients) ** 2, axis=0)


def difference(
    answer: SpamsAnswer, reference: Solution, signals: np.ndarray, dictionary: np.ndarray
) -> str | None:
    """A sentence that says how SPAMS differs; None if both agree."""
    missing = sorted(set(reference.atoms) - set(answer.atoms))
    added = sorted(set(answer.atoms) - set(reference.atoms))
    energies = residual_energies(signals, dictionary, answer.atoms, answer.coefficients)
    left = f"an energy of {energies.sum():.6g} against {reference.energies[-1]:.6g}"
    if not np.isfinite(answer.coefficients).all():
        twice = len(answer.atoms) - len(set(answer.atoms))
        return f"SPAMS returns coefficients that are not finite{' and one atom twice' if twice else ''}."
    if len(answer.atoms) < len(reference.atoms):
        return f"SPAMS stops after {len(answer.atoms)} atoms and leaves {left}."
    if not reference.atoms:
        return "SPAMS chooses an atom for signals that are zero."
    if missing and abs(energies.sum() - reference.energies[-1]) < 1e-9:
        return f"SPAMS takes {added} for {missing}, which explain as much."
    if missing:
        return f"SPAMS takes {added} for {missing} and leaves {left}."
    if answer.atoms != reference.atoms:
        return "SPAMS chooses the same atoms in another order."
    least = np.linalg.svd(dictionary[:, answer.atoms], compute_uv=False)[-1]
    gap = abs(answer.coefficients - reference.coefficients).max()
    return (
        None
        if gap <= TOLERANCE / least**2
        else f"SPAMS has the same atoms, but coefficients that differ by {gap:.2g}."
    )


def number(value: float, digits: int) -> float | None:
    """None for NaN and infinity, which JSON does not support."""
    return golden.f64s(value, digits) if np.isfinite(value) else None


def numbers(values: np.ndarray) -> list[float | None]:
    return [number(v, 12) for v in values]


def spams_record(answer: SpamsAnswer, signals: np.ndarray, dictionary: np.ndarray) -> dict[str, Any]:
    energies = residual_energies(signals, dictionary, answer.atoms, answer.coefficients)
    return {
        "atoms": answer.atoms,
        "coefficients": numbers(answer.coefficients[:, 0]),
        "residual_energies": numbers(energies),
        "ordered": answer.ordered,
    }


def reference_record(reference: Solution, signals: np.ndarray, dictionary: np.ndarray) -> dict[str, Any]:
    energies = residual_energies(signals, dictionary, reference.atoms, reference.coefficients)
    return {
        "atoms": reference.atoms,
        "coefficients": numbers(reference.coefficients[:, 0]),
        "residual_energies": numbers(energies),
        "step_energies": numbers(np.array(reference.energies)),
        "margin": number(reference.margin, 4),
        "clearance": number(reference.clearance, 4),
    }


def compare(signals: np.ndarray, dictionary: np.ndarray) -> tuple[dict[str, Any], str | None]:
    """The record of one problem, and a sentence about the difference if there is one."""
    answer = by_spams(signals, dictionary)
    reference = somp_reference.solve(signals, dictionary, LIMIT)
    textbook = somp_reference.solve(signals, dictionary, LIMIT, divide=False)
    record = {
        "spams": spams_record(answer, signals, dictionary),
        "reference": reference_record(reference, signals, dictionary),
        "textbook": {"atoms": textbook.atoms, "margin": number(textbook.margin, 4)},
    }
    return record, difference(answer, reference, signals, dictionary)
