"""An analytic subsystem x' = A x + B u, y = C x + D u, stepped exactly under polynomial inputs.

Input polynomials are chains of integrators, c_k' = c_(k+1), appended to the state; the system is then homogeneous and
takes one matrix exponential per step length (Van Loan 1978). Tests couple such systems, whose answers are known.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .subsystem import Port

__all__ = ["Linear"]


@dataclass
class Linear:
    """A linear system with n states, n_u inputs and n_y outputs; n may be 0.

    Attributes
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, n_u), (n_y, n), (n_y, n_u)
        Matrices.
    start : ndarray, shape (n,)
        State at the start.
    state : ndarray, shape (n,)
        State now.
    steps : int
        Number of calls of step().
    """

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
    state: np.ndarray = field(init=False)
    steps: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        """Set the start state and inputs of zero."""
        self.state = np.array(self.start, dtype=float)
        self._u = np.zeros((4, len(self.inputs)))
        self._flows: dict[float, np.ndarray] = {}

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Return the outputs (n_y,) of the start state for input values (n_u,)."""
        self.state = np.array(self.start, dtype=float)
        self._u[:] = 0.0
        self._u[0] = values
        return self.values()

    def begin(self) -> None:
        """End initialization."""

    def accepted_input_order(self, order: int) -> int:
        """Return the order: all are taken."""
        return order

    def set_inputs(self, polynomials: np.ndarray) -> None:
        """Set the inputs (4, n_u)."""
        self._u[:] = polynomials

    def step(self, time: float, length: float) -> None:
        """Advance state and inputs by `length` [s]."""
        self.steps += 1
        flow = self._flow(length)
        z = flow @ np.concatenate([self.state, self._u.ravel()])
        n = len(self.state)
        self.state = z[:n]
        self._u[0] = z[n : n + len(self.inputs)]
        self._u[1:] = z[n + len(self.inputs) :].reshape(3, -1)

    def values(self) -> np.ndarray:
        """Return the outputs (n_y,)."""
        return self.C @ self.state + self.D @ self._u[0]

    def rates(self) -> np.ndarray:
        """Return the time derivatives (n_y,) of the outputs."""
        return self.C @ (self.A @ self.state + self.B @ self._u[0]) + self.D @ self._u[1]

    def tangent(self, columns: np.ndarray) -> np.ndarray:
        """Return the columns of D."""
        return self.D[:, columns]

    def save(self, into: object = None) -> tuple[np.ndarray, np.ndarray]:
        """Return copies of state and inputs."""
        return self.state.copy(), self._u.copy()

    def restore(self, state: tuple[np.ndarray, np.ndarray]) -> None:
        """Return to saved state and inputs."""
        self.state, self._u = state[0].copy(), state[1].copy()

    def free(self, state: object) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def _flow(self, length: float) -> np.ndarray:
        if length not in self._flows:
            from scipy.linalg import expm  # slow to load

            n, m = len(self.state), len(self.inputs)
            generator = np.zeros((n + 4 * m, n + 4 * m))
            generator[:n, :n] = self.A
            generator[:n, n : n + m] = self.B
            generator[n : n + 3 * m, n + m :] = np.eye(3 * m)
            self._flows[length] = expm(generator * length)
        return self._flows[length]
