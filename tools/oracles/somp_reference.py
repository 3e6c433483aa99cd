"""Simultaneous orthogonal matching pursuit in f64, from its definition: slow and as simple as possible.

At most `limit` atoms are selected one by one. Let P be the projection onto the complement of the selected
atoms. The next atom is

- order-recursive: the atom d with the largest ||(P R)^T d||^2 / ||P d||^2, which reduces the residual most;
- textbook: the atom d with the largest ||(P R)^T d||^2.

The coefficients are then the least-squares fit of R on the chosen atoms.
"""

from dataclasses import dataclass

import numpy as np

# An atom of length 1 counts as dependent on the selected ones if its remaining squared length is below this.
DEPENDENT = 1e-6
# Share of the signals' energy that remains due to rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Solution:
    """Atoms in the order of selection, coefficients (atoms x signals), and how clear the selection was."""

    atoms: list[int]
    coefficients: np.ndarray
    # Energy of the residual of all signals before the first step and after each step.
    energies: list[float]
    # Minimum of (best - second best) / best over the steps: near 0, rounding may change the selection.
    margin: float
    # Minimum factor between any atom's ||P d||^2 and DEPENDENT: near 1, rounding may change the decision.
    clearance: float


def remainder(a: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """The columns of `a` after projecting out an orthonormal basis, twice to reduce rounding errors."""
    for _ in range(2):
        a = a - basis @ (basis.T @ a)
    return a


def solve(signals: np.ndarray, dictionary: np.ndarray, limit: int, divide: bool = True) -> Solution:
    atoms: list[int] = []
    margin, clearance = np.inf, np.inf
    basis = np.zeros((len(signals), 0))
    residual, rest = signals, dictionary
    energies = [float(np.sum(residual**2))]
    while len(atoms) < limit and energies[-1] > ROUNDING * energies[0]:
        lengths = np.sum(rest**2, axis=0)
        others = np.delete(lengths, atoms)
        others = others[others > 0]
        clearance = min(clearance, np.exp(np.abs(np.log(others / DEPENDENT)).min()))
        eligible = lengths >= DEPENDENT
        if not eligible.any():
            break
        gains = np.where(eligible, np.sum((residual.T @ dictionary) ** 2, axis=0), -1.0)
        gains = np.where(eligible & divide, gains / np.where(eligible, lengths, 1.0), gains)
        best = int(np.argmax(gains))
        margin = min(margin, (gains[best] - np.delete(gains, best).max()) / gains[best])
        atoms.append(best)
        basis = np.linalg.qr(dictionary[:, atoms])[0]
        residual, rest = remainder(signals, basis), remainder(dictionary, basis)
        energies.append(float(np.sum(residual**2)))
    coefficients = np.linalg.lstsq(dictionary[:, atoms], signals, rcond=None)[0]
    return Solution(atoms, coefficients, energies, float(margin), float(clearance))
