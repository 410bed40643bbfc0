"""What past sweeps tell of the loop: differences of guesses x and residuals r = G(x) - x, newest first, at most n
columns.

With V = [dr] and X = [dx] the error of a guess is estimated as e = -X V+ r on the span of V, where this is the secant
(multi-Broyden, IQN-ILS) step, and as the plain step r on the rest, of which nothing is known. Filter: going from new to
old, a column is dropped whose part orthogonal to the newer ones is small (QR2 of preCICE), so old columns serve until
newer knowledge replaces them.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["Secants", "norm", "spectral_radius"]

INDEPENDENT = 3e-3  # least orthogonal part of a unit column


class Secants:
    """n: size of the interface vector, which is in units of the nominals here."""

    def __init__(self, n: int) -> None:
        self.size = n
        self.columns: list[np.ndarray] = []  # (2n,) dr and dx behind each other, newest first, each with |dr| = 1
        self._combined = np.zeros((0, 2 * n))  # rows: combinations of the columns whose dr are orthonormal
        self._identity = np.eye(n)

    def add(self, dx: np.ndarray, dr: np.ndarray) -> None:
        """Takes in the difference of two sweeps of the same macro step."""
        length = norm(dr)
        if length == 0.0:
            return
        n = self.size
        kept: list[np.ndarray] = []
        combined = np.zeros((n, 2 * n))
        for column in (np.concatenate((dr, dx)) / length, *self.columns):
            rest = column
            if kept:
                rest = column - combined[:, :n].dot(column[:n]).dot(combined)  # the rows not filled yet are null
            left = norm(rest[:n])
            if left > INDEPENDENT:
                combined[len(kept)] = rest / left
                kept.append(column)
                if len(kept) == n:
                    break
        self.columns, self._combined = kept, combined[: len(kept)]

    def split(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The secant step (n,) for a residual, and the part (n,) of the residual on which no column bears."""
        n = self.size
        known = self._combined[:, :n].dot(r).dot(self._combined)
        return -known[n:], r - known[:n]

    def error(self, r: np.ndarray) -> np.ndarray:
        """Estimate (n,) of x* - x for the residual r of x."""
        secant, rest = self.split(r)
        return secant + rest

    @property
    def inverse(self) -> np.ndarray | None:
        """Estimate (n, n) of (I - S)^-1, S = dG/dx; None without a column."""
        if not self.columns:
            return None
        basis, steps = self._combined[:, : self.size], self._combined[:, self.size :]
        return self._identity - (steps + basis).T @ basis

    @property
    def gain(self) -> float:
        """Estimated spectral radius of S; nan without a column."""
        inverse = self.inverse
        return math.nan if inverse is None else float(spectral_radius(inverse))


def norm(v: np.ndarray) -> float:
    """Euclidean, of (n,); for a few numbers a fraction of what numpy takes."""
    return math.hypot(*v.tolist())


def spectral_radius(inverse: np.ndarray) -> np.ndarray:
    """Spectral radius of S = I - inverse^-1 for a stack (..., n, n) of matrices inverse = (I - S)^-1."""
    eigenvalues = np.linalg.eigvals(inverse)
    with np.errstate(divide="ignore"):
        return np.abs(1.0 - 1.0 / eigenvalues).max(axis=-1, initial=0.0)
