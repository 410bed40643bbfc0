"""What past sweeps tell of the loop: differences of guesses x and residuals r = G(x) - x, newest first, at most n
columns.

With V = [dr], W = [dx + dr] the error of a guess is estimated as e = (I - W V+) r, which is the IQN-ILS (Anderson)
update: exact where V spans the residual, the plain update r on the rest. Filter: going from new to old, a column is
dropped whose part orthogonal to the newer ones is small (QR2 of preCICE), so old columns serve until newer knowledge
replaces them."""

from __future__ import annotations

import numpy as np

__all__ = ["Secants", "spectral_radius"]

INDEPENDENT = 3e-3  # least orthogonal part of a unit column


class Secants:
    """n: size of the interface vector, which is in units of the nominals here."""

    def __init__(self, n: int) -> None:
        self.size = n
        self.columns: list[tuple[np.ndarray, np.ndarray]] = []  # (dx, dr), newest first, each with |dr| = 1
        self.inverse = np.eye(n)  # estimate of (I - S)^-1, S = dG/dx; replaced, never written into

    def add(self, dx: np.ndarray, dr: np.ndarray) -> None:
        """Takes in the difference of two sweeps of the same macro step."""
        length = np.sqrt(dr @ dr)
        if length == 0.0:
            return
        kept: list[tuple[np.ndarray, np.ndarray]] = []
        basis: list[np.ndarray] = []
        triangle = np.zeros((self.size, self.size))
        for column in [(dx / length, dr / length), *self.columns]:
            rest = column[1]
            k = len(kept)
            if k == self.size:
                break
            for i, q in enumerate(basis):
                triangle[i, k] = q @ rest
                rest = rest - triangle[i, k] * q
            triangle[k, k] = np.sqrt(rest @ rest)
            if triangle[k, k] > INDEPENDENT:
                kept.append(column)
                basis.append(rest / triangle[k, k])
        self.columns = kept
        k = len(kept)
        pseudo_inverse = np.linalg.solve(triangle[:k, :k], np.array(basis))
        w = np.array([dx + dr for dx, dr in kept])
        self.inverse = np.eye(self.size) - w.T @ pseudo_inverse

    def error(self, r: np.ndarray) -> np.ndarray:
        """Estimate (n,) of x* - x for the residual r of x."""
        return self.inverse @ r

    @property
    def gain(self) -> float:
        """Estimated spectral radius of S; nan without a column."""
        return float(spectral_radius(self.inverse)) if self.columns else np.nan


def spectral_radius(inverse: np.ndarray) -> np.ndarray:
    """Spectral radius of S = I - inverse^-1 for a stack (..., n, n) of matrices inverse = (I - S)^-1."""
    eigenvalues = np.linalg.eigvals(inverse)
    with np.errstate(divide="ignore"):
        return np.abs(1.0 - 1.0 / eigenvalues).max(axis=-1, initial=0.0)
