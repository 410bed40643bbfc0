"""What past sweeps tell of the loop: differences of guesses x and residuals r = G(x) - x, newest first, at most n
columns.

With V = [dr], W = [dx + dr] the error of a guess is estimated as e = (I - W V+) r, which is the IQN-ILS (Anderson)
update: exact where V spans the residual, the plain update r on the rest. Filter: going from new to old, a column is
dropped whose part orthogonal to the newer ones is small (QR2 of preCICE), so old columns serve until newer knowledge
replaces them."""

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
        self.inverse = np.eye(n)  # estimate of (I - S)^-1, S = dG/dx; replaced, never written into

    def add(self, dx: np.ndarray, dr: np.ndarray) -> None:
        """Takes in the difference of two sweeps of the same macro step."""
        length = math.sqrt(dr @ dr)
        if length == 0.0:
            return
        # Gram-Schmidt on the dr, and the same combinations of the dx + dr: (I - W V+) then needs no solve.
        kept: list[tuple[np.ndarray, np.ndarray]] = []
        basis: list[np.ndarray] = []
        images: list[np.ndarray] = []
        for column in ((dx / length, dr / length), *self.columns):
            rest, image = column[1], column[0] + column[1]
            for q, w in zip(basis, images, strict=True):
                share = q @ rest
                rest, image = rest - share * q, image - share * w
            left = math.sqrt(rest @ rest)
            if left > INDEPENDENT:
                kept.append(column)
                basis.append(rest / left)
                images.append(image / left)
            if len(kept) == self.size:
                break
        self.columns = kept
        self.inverse = np.eye(self.size) - np.array(images).T @ np.array(basis)

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
