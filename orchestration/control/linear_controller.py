"""A linear-quadratic regulator with a Kalman filter on a linear model (LQG), in discrete time.

With x_{k+1} = F x_k + G u_k and y_k = C x_k + D u_k the gain K minimises sum |y/w_y|^2 + |u/w_u|^2, and the filter's
gain L is that of white noise at inputs and outputs; both come from discrete Riccati equations (Anderson & Moore,
Optimal Control, 1990, chapters 2 and 7).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from ..errors import SceneError
from ..linear import LinearModel
from .checks import require_numbers, require_positive

__all__ = ["LinearController"]

REGULARIZATION = 1e-9  # weight of all states, so that the Riccati equations have a stabilising solution


class LinearController:
    """Holds outputs at the operating point of a linear model, or moves them to set points near it.

    Parameters
    ----------
    model : LinearModel
        From the inputs that are set to the outputs that are measured; reduced, or with few states.
    step : float
        Time between updates [s].
    outputs, inputs : mapping of str to float
        Name of a vector or scalar -> deviation that weighs as much as all others.
    noise : float
        Standard deviation of measured outputs, in units of their weights.
    disturbance : float
        That of disturbances at the inputs, in units of their weights.

    Raises
    ------
    SceneError
        A number is not positive, a weight is missing, or the model cannot be stabilised.
    """

    def __init__(
        self,
        model: LinearModel,
        step: float,
        outputs: Mapping[str, float],
        inputs: Mapping[str, float],
        noise: float = 0.1,
        disturbance: float = 1.0,
    ) -> None:
        for what, value in (("step", step), ("noise", noise), ("disturbance", disturbance)):
            require_positive(what, value)
        self.model = model
        n, m = model.B.shape
        block = np.zeros((n + m, n + m))
        block[:n, :n], block[:n, n:] = model.A, model.B
        exact = expm(block * step)
        self._F, self._G = exact[:n, :n], exact[:n, n:]
        w_y = np.array([_weight(q.name, outputs) for q in model.outputs])
        w_u = np.array([_weight(q.name, inputs) for q in model.inputs])
        self._C, self._D, self._w_y = model.C / w_y[:, None], model.D / w_y[:, None], w_y
        small = REGULARIZATION * np.eye(n)
        try:
            R = np.diag(1.0 / w_u**2) + self._D.T @ self._D
            S = self._C.T @ self._D
            X = solve_discrete_are(self._F, self._G, self._C.T @ self._C + small, R, s=S)
            self.K = np.linalg.solve(R + self._G.T @ X @ self._G, self._G.T @ X @ self._F + S.T)
            W = self._G @ np.diag((disturbance * w_u) ** 2) @ self._G.T + small
            V = noise**2 * np.eye(len(w_y))
            Y = solve_discrete_are(self._F.T, self._C.T, W, V)
        except (np.linalg.LinAlgError, ValueError) as error:
            raise SceneError(
                f"the linear model cannot be regulated with these weights ({error}); reduce it by balanced truncation"
            ) from error
        self.L = np.linalg.solve(self._C @ Y @ self._C.T + V, self._C @ Y).T
        self._closed = self._F - self._G @ self.K
        self.x = np.zeros(n)
        self.u = np.zeros(m)
        self._target_x, self._target_u = np.zeros(n), np.zeros(m)

    def set_target(self, deviation: np.ndarray) -> None:
        """Set wanted outputs (p,) as deviations from the operating point: steady inputs and states for them.

        Raises SceneError where they are not p finite numbers.
        """
        deviation = require_numbers("deviation", deviation, len(self._w_y))
        n = len(self._F)
        system = np.block([[self._F - np.eye(n), self._G], [self._C, self._D]])
        right = np.concatenate([np.zeros(n), deviation / self._w_y])
        solution = np.linalg.lstsq(system, right, rcond=None)[0]
        self._target_x, self._target_u = solution[:n], solution[n:]

    def poles(self) -> np.ndarray:
        """Return the poles (n,) of the regulated model in discrete time; all are inside the unit circle."""
        return np.linalg.eigvals(self._closed)

    def update(self, outputs: np.ndarray, least: float = -np.inf, most: float = np.inf) -> np.ndarray:
        """Return the inputs (m,) until the next update, within bounds, for measured outputs (p,).

        Raises SceneError where they are not p finite numbers.
        """
        outputs = require_numbers("outputs", outputs, len(self._w_y))
        predicted = self._C @ self.x + self._D @ self.u
        estimate = self.x + self.L @ ((outputs - self.model.y_0) / self._w_y - predicted)
        wanted = self._target_u - self.K @ (estimate - self._target_x)
        self.u = np.clip(self.model.u_0 + wanted, least, most) - self.model.u_0
        self.x = self._F @ estimate + self._G @ self.u
        return np.asarray(self.model.u_0 + self.u)


def _weight(name: str, weights: Mapping[str, float]) -> float:
    for key in (name, name.partition("[")[0]):
        if key in weights:
            if not weights[key] > 0.0:
                raise SceneError(f"weight of {key} = {weights[key]}: give a positive deviation")
            return weights[key]
    raise SceneError(f"no weight for {name}; give one for it or its vector")
