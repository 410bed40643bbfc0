"""Analytic subsystem x' = A x + B u, y = C x + D u, stepped exactly under polynomial inputs.

Appending the input polynomial as a chain of integrators, c_k' = c_(k+1), makes the system homogeneous: one matrix
exponential per step length. Used to test the coupling against known answers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

from .subsystem import Port

__all__ = ["Linear"]


@dataclass
class Linear:
    """Shapes: A (n, n), B (n, n_u), C (n_y, n), D (n_y, n_u), start (n,); n may be 0 for a purely algebraic system."""

    name: str
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    start: np.ndarray
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    has_rates: bool = True
    can_rollback: bool = True
    takes_polynomials: bool = True
    frozen: bool = False
    state: np.ndarray = field(init=False)  # (n,)
    steps: int = field(default=0, init=False)  # counts step(), for tests

    def __post_init__(self) -> None:
        self.state = np.array(self.start, dtype=float)
        self._u = np.zeros((4, len(self.inputs)))
        self._flows: dict[float, np.ndarray] = {}

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        self.state = np.array(self.start, dtype=float)
        self._u[:] = 0.0
        self._u[0] = values
        return self.values()

    def begin(self) -> None:
        pass

    def set_inputs(self, polynomials: np.ndarray) -> None:
        self._u[:] = polynomials

    def step(self, time: float, length: float) -> None:
        self.steps += 1
        flow = self._flow(length)
        z = flow @ np.concatenate([self.state, self._u.ravel()])
        n = len(self.state)
        self.state = z[:n]
        self._u[0] = z[n : n + len(self.inputs)]
        self._u[1:] = z[n + len(self.inputs) :].reshape(3, -1)

    def values(self) -> np.ndarray:
        return self.C @ self.state + self.D @ self._u[0]

    def rates(self) -> np.ndarray:
        return self.C @ (self.A @ self.state + self.B @ self._u[0]) + self.D @ self._u[1]

    def tangent(self, columns: np.ndarray) -> np.ndarray:
        return self.D[:, columns]

    def save(self, into: object = None) -> tuple[np.ndarray, np.ndarray]:
        return self.state.copy(), self._u.copy()

    def restore(self, state: tuple[np.ndarray, np.ndarray]) -> None:
        self.state, self._u = state[0].copy(), state[1].copy()

    def free(self, state: object) -> None:
        pass

    def close(self) -> None:
        pass

    def _flow(self, length: float) -> np.ndarray:
        if length not in self._flows:
            n, m = len(self.state), len(self.inputs)
            generator = np.zeros((n + 4 * m, n + 4 * m))
            generator[:n, :n] = self.A
            generator[:n, n : n + m] = self.B
            generator[n : n + 3 * m, n + m :] = np.eye(3 * m)
            self._flows[length] = expm(generator * length)
        return self._flows[length]
