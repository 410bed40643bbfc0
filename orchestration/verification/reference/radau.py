"""Radau IIA of order 5 for linear systems M u' + K u = f(t): three stages, L-stable.

Each step length needs one real and one complex sparse factorisation; they are cached (Hairer, Wanner: Solving ODEs II,
IV.8).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

__all__ = ["NODES", "LinearRadau"]

_ROOT = np.sqrt(6.0)
NODES = np.array([(4 - _ROOT) / 10, (4 + _ROOT) / 10, 1.0])  # times of the stages as fractions of the step
_POWERS = np.arange(1, 4)
# Collocation: row k integrates the polynomial through the stages from 0 to NODES[k].
_STAGES = (NODES[:, None] ** _POWERS / _POWERS) @ np.linalg.inv(NODES[:, None] ** (_POWERS - 1))
_INVERSE = np.linalg.inv(_STAGES)
_VALUES, _VECTORS = np.linalg.eig(_INVERSE)
_BACK = np.linalg.inv(_VECTORS)
_ROUNDING = 1e-13  # a net load below this fraction of the load is rounding: the system is at rest


class LinearRadau:
    """Time integrator.

    Parameters
    ----------
    mass, stiffness : csc_matrix
        Symmetric matrices M and K, (n, n).
    """

    def __init__(self, mass: csc_matrix, stiffness: csc_matrix) -> None:
        self._mass, self._stiffness = mass.tocsc(), stiffness.tocsc()
        self._cache: dict[float, list[tuple[int, Callable[[np.ndarray], np.ndarray]]]] = {}

    def step(self, u: np.ndarray, h: float, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Advance u (n,) by one step of length h.

        Parameters
        ----------
        load : ndarray
            f at the three stages, (3, n).

        Returns
        -------
        tuple of ndarray
            u at the three stages, of which the last is the end of the step, and u' there, both (3, n).
        """
        forces = load - self._stiffness @ u
        if np.abs(forces).max() <= _ROUNDING * np.abs(load).max():
            return np.tile(u, (3, 1)), np.zeros((3, u.size))
        right = _BACK @ forces
        change = np.zeros((3, u.size))
        for k, solve in self._solvers(h):
            # A complex eigenvalue represents its conjugate as well.
            weight = 1.0 if _VALUES[k].imag == 0.0 else 2.0
            change += weight * (_VECTORS[:, k, None] * solve(right[k])).real
        return u + change, _INVERSE @ change / h

    def _solvers(self, h: float) -> list[tuple[int, Callable[[np.ndarray], np.ndarray]]]:
        """Factorise for a step length: an index of an eigenvalue and the solution of its system each."""
        key = float(f"{h:.9e}")  # step lengths that differ by rounding share one
        if key not in self._cache:
            solvers = []
            for k, value in enumerate(_VALUES):
                if value.imag >= 0.0:
                    weight = value if value.imag else value.real
                    factor = splu((weight / key * self._mass + self._stiffness).tocsc(), permc_spec="MMD_AT_PLUS_A")
                    solvers.append((k, factor.solve if value.imag else _real(factor.solve)))
            self._cache[key] = solvers
        return self._cache[key]


def _real(solve: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    return lambda right: solve(np.ascontiguousarray(right.real))
