"""A linear model: matrices with the names and units of what they act on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import expm

from ..errors import SceneError, similar

__all__ = ["LinearModel", "Quantity"]


@dataclass(frozen=True)
class Quantity:
    """A state, input or output.

    Attributes
    ----------
    name : str
        'member.variable'; of a reduced model, 'z[k]'.
    unit : str
        '1' where it has none.
    nominal : float
        Typical size, in that unit.
    """

    name: str
    unit: str
    nominal: float = 1.0


@dataclass(frozen=True)
class LinearModel:
    """Deviations from an operating point: dx/dt = A x + B u, y = C x + D u.

    The state itself moves as x_0 + x with dx_0/dt = `drift`; the model is exact for small deviations where the drift
    is 0, an equilibrium.

    Attributes
    ----------
    A, B, C, D : ndarray, shapes (n, n), (n, m), (p, n), (p, m)
        In the units of the quantities, and s.
    states, inputs, outputs : tuple of Quantity
        n, m and p of them.
    x_0, u_0, y_0, drift : ndarray, shapes (n,), (m,), (p,), (n,)
        Operating point, and the states' time derivatives there.
    time : float
        Of the operating point [s].
    scene : str
        Name of the scene.
    notes : tuple of str
        What a reader should know.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    x_0: np.ndarray
    u_0: np.ndarray
    y_0: np.ndarray
    drift: np.ndarray
    time: float = 0.0
    scene: str = ""
    notes: tuple[str, ...] = field(default=())

    def select(self, inputs: Sequence[str] = (), outputs: Sequence[str] = ()) -> LinearModel:
        """Return the model with some inputs and outputs only.

        Parameters
        ----------
        inputs, outputs : sequence of str
            Names, or those of vectors for all their elements; empty: all.

        Raises
        ------
        SceneError
            A name that the model does not have.
        """
        u, y = _chosen(inputs, self.inputs, "input"), _chosen(outputs, self.outputs, "output")
        return replace(
            self,
            B=self.B[:, u],
            C=self.C[y],
            D=self.D[np.ix_(y, u)],
            inputs=tuple(self.inputs[k] for k in u),
            outputs=tuple(self.outputs[k] for k in y),
            u_0=self.u_0[u],
            y_0=self.y_0[y],
        )

    def poles(self) -> np.ndarray:
        """Return the eigenvalues (n,) of A [1/s], the slowest first."""
        values = np.linalg.eigvals(self.A)
        return values[np.argsort(np.abs(values))]

    def frequency_response(self, frequencies: np.ndarray) -> np.ndarray:
        """Return C (i w - A)^-1 B + D, complex (f, p, m), at frequencies (f,) [Hz].

        Raises SceneError where a frequency is not finite, or that of an undamped pole.
        """
        eye = np.eye(len(self.A))
        responses = []
        for f in _finite("frequencies", frequencies):
            try:
                responses.append(self.C @ np.linalg.solve(2j * np.pi * f * eye - self.A, self.B) + self.D)
            except np.linalg.LinAlgError as error:
                raise SceneError(f"frequency {f:g} Hz: an undamped pole of the model; choose another") from error
        return np.array(responses)

    def impulse_response(self, times: np.ndarray) -> np.ndarray:
        """Return C exp(A t) B, (t, p, m), at times (t,) >= 0 [s]; the part D delta(t) is left out.

        Raises SceneError for other times.
        """
        return np.array([self.C @ expm(self.A * t) @ self.B for t in _finite("times", times, 0.0)])

    def step_response(self, times: np.ndarray) -> np.ndarray:
        """Return the outputs (t, p, m) at times (t,) >= 0 [s] after unit steps of each input at t = 0.

        Raises SceneError for other times.
        """
        n, m = self.B.shape
        augmented = np.zeros((n + m, n + m))
        augmented[:n, :n], augmented[:n, n:] = self.A, self.B
        return np.array([self.C @ expm(augmented * t)[:n, n:] + self.D for t in _finite("times", times, 0.0)])


def _finite(what: str, values: np.ndarray, least: float = -np.inf) -> np.ndarray:
    """Return values as an array. Raises SceneError where one is not finite, or below the least."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    wrong = array[~(np.isfinite(array) & (array >= least))]
    if wrong.size:
        raise SceneError(f"{what}: {wrong[0]:g}; give finite numbers" + (f" from {least:g} on" * math.isfinite(least)))
    return array


def _chosen(names: Sequence[str], quantities: Sequence[Quantity], what: str) -> list[int]:
    if isinstance(names, str):
        names = (names,)
    if not names:
        return list(range(len(quantities)))
    chosen: list[int] = []
    for name in names:
        matching = [k for k, q in enumerate(quantities) if q.name == name or q.name.startswith(f"{name}[")]
        if not matching:
            known = dict.fromkeys(q.name.partition("[")[0] for q in quantities)
            raise SceneError(f"{name}: the linear model has no such {what}; {similar(name, known)}")
        chosen += [k for k in matching if k not in chosen]
    return chosen
