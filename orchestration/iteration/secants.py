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

__all__ = ["Secants", "spectral_radius"]

INDEPENDENT = 3e-3  # least orthogonal part of a unit column


class Secants:
    """n: size of the interface vector, which is in units of the nominals here."""

    def __init__(self, n: int) -> None:
        self.size = n
        self.columns: list[tuple[np.ndarray, np.ndarray]] = []  # (dx, dr), newest first, each with |dr| = 1
        self.basis = np.zeros((0, n))  # rows: the dr made orthonormal
        self.steps = np.zeros((0, n))  # the same combinations of the dx
        self._identity = np.eye(n)

    def add(self, dx: np.ndarray, dr: np.ndarray) -> None:
        """Takes in the difference of two sweeps of the same macro step."""
        length = math.sqrt(dr @ dr)
        if length == 0.0:
            return
        kept: list[tuple[np.ndarray, np.ndarray]] = []
        basis, steps = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        for column in ((dx / length, dr / length), *self.columns):
            step, rest = column
            if kept:
                shares = basis @ rest  # the rows not filled yet are null
                step, rest = step - shares @ steps, rest - shares @ basis
            left = math.sqrt(rest @ rest)
            if left > INDEPENDENT:
                steps[len(kept)], basis[len(kept)] = step / left, rest / left
                kept.append(column)
                if len(kept) == self.size:
                    break
        self.columns, self.basis, self.steps = kept, basis[: len(kept)], steps[: len(kept)]

    def split(self, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The secant step (n,) for a residual, and the part (n,) of the residual on which no column bears."""
        shares = self.basis @ r
        return -(shares @ self.steps), r - shares @ self.basis

    def error(self, r: np.ndarray) -> np.ndarray:
        """Estimate (n,) of x* - x for the residual r of x."""
        secant, rest = self.split(r)
        return secant + rest

    @property
    def inverse(self) -> np.ndarray | None:
        """Estimate (n, n) of (I - S)^-1, S = dG/dx; None without a column."""
        return self._identity - (self.steps + self.basis).T @ self.basis if self.columns else None

    @property
    def gain(self) -> float:
        """Estimated spectral radius of S; nan without a column."""
        inverse = self.inverse
        return math.nan if inverse is None else float(spectral_radius(inverse))


def spectral_radius(inverse: np.ndarray) -> np.ndarray:
    """Spectral radius of S = I - inverse^-1 for a stack (..., n, n) of matrices inverse = (I - S)^-1."""
    eigenvalues = np.linalg.eigvals(inverse)
    with np.errstate(divide="ignore"):
        return np.abs(1.0 - 1.0 / eigenvalues).max(axis=-1, initial=0.0)
