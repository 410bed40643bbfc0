"""Nonlinear model-predictive control of outputs of the rod, such as its tip.

At each update the plan of a path (planning.problem) is solved over a moving horizon, with one quadratic program per
update (the real-time iteration of Diehl et al., SIAM J. Control Optim. 43, 2005): the powers of the last update, moved
on, are the point of linearisation. Between updates an observer follows the temperatures and the errors of the powers;
the difference between measured and predicted outputs, filtered, is taken to stay (offset-free control).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import SceneError
from ..planning.heat import HeatModel
from ..planning.limits import PlanLimits
from ..planning.problem import SMOOTHING, solve_quadratic_program
from ..planning.rod import StaticRod
from .checks import require_numbers, require_positive
from .observer import HeatObserver, ObserverNoise

__all__ = ["PredictiveController"]

REFERENCE_FILTER = 0.3  # share of a new difference between measured and predicted outputs that is taken over
UNKNOWN_START = 20.0  # [K] standard deviation of temperatures at the start: the plant may have been used before
MARGIN = 0.5  # [K] kept from the limits of temperature: what noise makes of it in an update


class PredictiveController:
    """Chooses voltages so that outputs follow a path.

    Parameters
    ----------
    heat : HeatModel
    rod : StaticRod
        Its first p outputs are controlled, its last N are the displacements.
    path : callable
        Wanted outputs (k, p) at times (k,) [s].
    limits : PlanLimits
        Of voltages, mean temperatures and hottest points.
    step : float
        Time between updates [s].
    horizon : float
        How far it looks ahead [s].
    knots : int
        Intervals of constant power in the horizon.
    scale : float
        Size of the outputs, in which errors are weighed.
    noise : ObserverNoise, optional
        What the observer reckons with; default: temperatures at the start are not known.

    Raises
    ------
    SceneError
        A number is not positive, the horizon is shorter than a step for each knot, or the rod's outputs do not fit.
    """

    def __init__(
        self,
        heat: HeatModel,
        rod: StaticRod,
        path: Callable[[np.ndarray], np.ndarray],
        limits: PlanLimits,
        step: float = 0.1,
        horizon: float = 10.0,
        knots: int = 20,
        scale: float = 1e-2,
        noise: ObserverNoise | None = None,
    ) -> None:
        for what, value in (("step", step), ("horizon", horizon), ("knots", knots), ("scale", scale)):
            require_positive(what, value)
        if horizon < knots * step:
            raise SceneError(f"horizon = {horizon:g} s: shorter than {knots} knots of {step:g} s; give fewer knots")
        self.heat, self.rod, self.path, self.limits, self.step, self.scale = heat, rod, path, limits, step, scale
        self.observer = HeatObserver(heat, rod, step, noise or ObserverNoise(start=UNKNOWN_START))
        self._distance = horizon / knots
        model = heat.at_knots(self._distance, knots)
        self._model = model
        N = self.observer.error.size
        Phi = np.zeros((knots, N, knots, N))
        for k in range(knots):
            Phi[k, :, : k + 1] = model.response[k::-1].transpose(1, 0, 2)
        self._Phi = Phi.reshape(knots * N, knots * N)
        self.shape = (knots, N)
        differences = np.diff(np.eye(knots), axis=0)
        self._S = SMOOTHING * np.kron(differences.T @ differences, np.eye(N))
        self._largest = limits.voltage**2 / heat.electrics.R
        self._rise = np.tile(heat.local_rise(), knots)
        self._share = np.full(self.shape, 0.01)
        self._outputs = len(rod.names) - self.observer.strained
        self._difference = np.zeros(self._outputs)  # between measured and predicted outputs, filtered
        self._measured = np.zeros(self._outputs, dtype=bool)

    def measure(self, outputs: np.ndarray, temperatures: np.ndarray, deviation: float) -> None:
        """Take in measured outputs (p,) and temperatures (N,) [K], the latter of that standard deviation [K].

        Either may be nan where a sensor gives nothing. Raises SceneError for other numbers or shapes.
        """
        outputs = require_numbers("outputs", outputs, self._outputs, missing=True)
        self.observer.measure_temperatures(temperatures, deviation)
        predicted = self.rod.outputs(self.observer.temperatures[None])[0][: len(outputs)]
        new = np.where(np.isfinite(outputs), outputs - predicted, self._difference)
        old = np.where(self._measured, self._difference, new)
        self._difference = old + REFERENCE_FILTER * (new - old)
        self._measured |= np.isfinite(outputs)

    def update(self, time: float) -> np.ndarray:
        """Return the voltages (N,) [V] from `time` [s] to the next update, and let the observer go on to it."""
        knots, N = self.shape
        ahead = time + self._distance * np.arange(1, knots + 1)
        scale = self._largest * (1.0 + self.observer.error)  # power that a share of 1 really has
        rest = np.empty(self.shape)
        x = self.observer.x
        for k in range(knots):
            x = self._model.F @ x + self._model.f
            rest[k] = self.heat.T_start + self.heat.C @ x
        Phi = self._Phi * np.tile(scale, knots)
        moved = self.step / self._distance
        share = (1.0 - moved) * self._share + moved * np.vstack([self._share[1:], self._share[-1:]])
        T = rest + (Phi @ share.ravel()).reshape(self.shape)
        outputs, tangents = self.rod.linear(T, ahead)
        wanted, p = np.asarray(self.path(ahead), dtype=float), self._outputs
        if wanted.shape != (knots, p) or not np.isfinite(wanted).all():
            raise SceneError(f"path: shape {wanted.shape}, or not finite; give finite numbers of shape ({knots}, {p})")
        error = ((outputs[:, :p] + self._difference - wanted) / self.scale).ravel()
        size = knots * N
        M = np.einsum("kpn,knm->kpm", tangents[:, :p], Phi.reshape(knots, N, size)).reshape(-1, size) / self.scale
        H, g = M.T @ M + self._S, M.T @ error + self._S @ share.ravel()
        rows, bounds = self._temperature_rows(Phi, np.tile(scale, knots), share.ravel(), T.ravel())
        step = solve_quadratic_program(H, g, share.ravel(), rows, bounds)
        if step is None:  # the solver gave up: cool
            step = -share.ravel()
        self._share = np.clip(share + step.reshape(self.shape), 0.0, 1.0)
        powers = self._share[0] * self._largest
        voltages = np.minimum(np.sqrt(powers * self.observer.resistances()), self.limits.voltage)
        self.observer.predict(voltages)
        return voltages

    def _temperature_rows(
        self, Phi: np.ndarray, scale: np.ndarray, share: np.ndarray, T: np.ndarray
    ) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return rows and bounds of the step for mean temperatures and hottest points at the knots.

        Bounds are never below what no power at all reaches, so that there is always a step.
        """
        hot = Phi + np.diag(self._rise * scale)
        cases = [(hot, self.limits.hottest - T - self._rise * scale * share)]
        if self.limits.temperature < self.limits.hottest:  # else kept by the hottest points
            cases.append((Phi, self.limits.temperature - T))
        return [rows for rows, _ in cases], [np.maximum(room - MARGIN, -rows @ share) for rows, room in cases]
