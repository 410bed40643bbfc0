"""Secants of past sweeps: differences of guesses x and residuals r = G(x) - x, newest first, at most n columns.

With V = [dr] and X = [dx] the error of a guess is estimated as e = -X V+ r on the span of V, where this is the secant
(multi-Broyden, IQN-ILS) step, and as the fixed-point step r on the rest, of which nothing is known. Filter: from new to
old, a column is dropped whose part orthogonal to the newer ones is small (QR2 of preCICE), so old columns serve until
newer ones replace them.
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["Secants", "norm", "spectral_radius"]

INDEPENDENCE = 3e-3  # least norm of the orthogonal part of a unit column; below, it is mostly noise


class Secants:
    """Columns for an interface vector of size n in units of the nominals.

    Attributes
    ----------
    columns : list of ndarray, shape (2n,)
        dr followed by dx, newest first, each with |dr| = 1.
    combined : ndarray, shape (k, 2n)
        Combinations of the k columns whose dr are orthonormal.
    """

    def __init__(self, n: int) -> None:
        self.size = n
        self.columns: list[np.ndarray] = []
        self.combined = np.zeros((0, 2 * n))
        self._identity = np.eye(n)

    def add(self, dx: np.ndarray, dr: np.ndarray) -> None:
        """Add the difference (n,), (n,) of two sweeps of the same macro step."""
        length = norm(dr)
        if length == 0.0:
            return
        n = self.size
        kept: list[np.ndarray] = []
        combined = np.zeros((n, 2 * n))
        for column in (np.concatenate((dr, dx)) / length, *self.columns):
            rest = column
            if kept:
                rest = column - combined[:, :n].dot(column[:n]).dot(combined)  # rows not filled yet are zero
            left = norm(rest[:n])
            if left > INDEPENDENCE:
                combined[len(kept)] = rest / left
                kept.append(column)
                if len(kept) == n:
                    break
        self.columns, self.combined = kept, combined[: len(kept)]

    def split(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the secant step (n,) for a residual, and the part (n,) of the residual that no column covers."""
        n = self.size
        known = self.combined[:, :n].dot(r).dot(self.combined)
        return -known[n:], r - known[:n]

    def error(self, r: np.ndarray) -> np.ndarray:
        """Return an estimate (n,) of x* - x for the residual r (n,) of x."""
        secant, rest = self.split(r)
        return secant + rest

    @property
    def inverse(self) -> np.ndarray | None:
        """Estimate of (I - S)^-1 (n, n), S = dG/dx; None without a column."""
        return self.inverse_of(self.combined) if self.columns else None

    def inverse_of(self, combined: np.ndarray) -> np.ndarray:
        """Return what `inverse` (..., n, n) is for these combinations (..., k, 2n)."""
        basis, steps = combined[..., : self.size], combined[..., self.size :]
        inverse: np.ndarray = self._identity - np.swapaxes(steps + basis, -1, -2) @ basis
        return inverse

    @property
    def gain(self) -> float:
        """Estimated spectral radius of S; nan without a column."""
        inverse = self.inverse
        return math.nan if inverse is None else float(spectral_radius(inverse))


def norm(v: np.ndarray) -> float:
    """Return the Euclidean norm of v (n,); for a few numbers several times faster than numpy's."""
    return math.hypot(*v.tolist())


def spectral_radius(inverse: np.ndarray) -> np.ndarray:
    """Return the spectral radii (...) of S = I - inverse^-1 for matrices (..., n, n) inverse = (I - S)^-1."""
    eigenvalues = np.linalg.eigvals(inverse)
    with np.errstate(divide="ignore"):
        return np.abs(1.0 - 1.0 / eigenvalues).max(axis=-1, initial=0.0)
