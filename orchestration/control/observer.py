"""An extended Kalman filter for the temperatures of the manipulator.

States are the modes x of the heat model and a relative error e of each TCA's power, a random walk, which takes up a
wrong resistance and what else heats or cools:

    x_{k+1} = F x_k + G (1 + e_k) P_k + f,    e_{k+1} = e_k.

Measured are mean temperatures, or the resistances R_i (1 + alpha (T_i - T_ref) + beta delta_i(T)/L), in which the rod's
equilibrium gives the displacements (self-sensing). The covariance is updated in Joseph's form (Simon, Optimal State
Estimation, 2006, sections 5.1 and 13.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..planning.heat import HeatModel
from ..planning.rod import StaticRod
from ..scene.manipulator import DISPLACEMENT
from .checks import require_numbers, require_positive

__all__ = ["HeatObserver", "ObserverNoise"]


HEATED_FOR = (1.0, 10.0, 100.0)  # [s] before the start: from a TCA's own section to the whole body


@dataclass(frozen=True)
class ObserverNoise:
    """Standard deviations.

    Attributes
    ----------
    power : float
        Of the relative error of a power at the start.
    power_drift : float
        Of its change per root of a second.
    temperature : float
        Of what the heat model leaves out of each mode, per root of a second [K].
    start : float
        Of the mean temperatures at the start, as unknown heating before makes them [K]; 0: they are the scene's.
    """

    power: float = 0.3
    power_drift: float = 0.02
    temperature: float = 0.02
    start: float = 0.0


class HeatObserver:
    """Estimates the temperatures step by step.

    Parameters
    ----------
    heat : HeatModel
    rod : StaticRod
        Its last n outputs are the displacements of its n TCAs.
    step : float
        Time between measurements [s].
    noise : ObserverNoise, optional

    Raises
    ------
    SceneError
        The rod's last outputs are not the displacements, or the step is not positive.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Modes [K].
    error : ndarray, shape (N,)
        Relative errors of the powers.
    strained : int
        n.
    """

    def __init__(self, heat: HeatModel, rod: StaticRod, step: float, noise: ObserverNoise | None = None) -> None:
        noise = noise or ObserverNoise()
        require_positive("step", step)
        self.strained = heat.electrics.strain.shape[1]
        displacements = tuple(f"{DISPLACEMENT}[{i + 1}]" for i in range(self.strained))
        if rod.names[-len(displacements) :] != displacements:
            raise SceneError(f"the rod's outputs are {', '.join(rod.names)}; end them with {', '.join(displacements)}")
        self.heat, self.rod = heat, rod
        model = heat.at_knots(step, 1)
        self._F, self._G, self._f = model.F, model.G, model.f
        n, N = self._G.shape
        self.x, self.error = np.zeros(n), np.zeros(N)
        self._P = np.diag(np.concatenate([np.zeros(n), np.full(N, noise.power**2)]))
        self._P[:n, :n] = _start_covariance(heat, noise.start)
        drift = np.concatenate([np.full(n, noise.temperature**2), np.full(N, noise.power_drift**2)])
        self._Q = step * np.diag(drift)
        self._seen = np.hstack([heat.C, np.zeros((N, N))])

    @property
    def temperatures(self) -> np.ndarray:
        """Estimated mean temperatures (N,) [K]."""
        return np.asarray(self.heat.T_start + self.heat.C @ self.x)

    @property
    def displacements(self) -> np.ndarray:
        """Estimated displacements (n,) [m]."""
        return self.rod.outputs(self.temperatures[None])[0][-self.strained :]

    def resistances(self) -> np.ndarray:
        """Return the estimated resistances (N,) [ohm]."""
        electrics = self.heat.electrics
        return electrics.at(self.temperatures, self.displacements) if electrics.has_feedback else electrics.R

    def predict(self, voltages: np.ndarray) -> None:
        """Go one step on, with voltages (N,) [V] during it. Raises SceneError where they are not N finite numbers."""
        N, n = len(self.error), len(self.x)
        powers = require_numbers("voltages", voltages, N) ** 2 / self.resistances()
        self.x = self._F @ self.x + self._G @ ((1.0 + self.error) * powers) + self._f
        transition = np.block([[self._F, self._G * powers], [np.zeros((N, n)), np.eye(N)]])
        self._P = transition @ self._P @ transition.T + self._Q

    def measure_temperatures(self, values: np.ndarray, deviation: float) -> None:
        """Take in measured temperatures (N,) [K] of that standard deviation [K]; nan where there is none."""
        values = require_numbers("temperatures", values, len(self.error), missing=True)
        require_positive("deviation", deviation)
        there = np.isfinite(values)
        self._update((values - self.temperatures)[there], self._seen[there], deviation)

    def measure_resistances(self, values: np.ndarray, deviation: float) -> None:
        """Take in measured resistances (N,) [ohm] of that standard deviation [ohm]; nan where there is none."""
        electrics = self.heat.electrics
        values = require_numbers("resistances", values, len(self.error), missing=True)
        require_positive("deviation", deviation)
        T = self.temperatures
        outputs, tangents = self.rod.linear(T[None])
        predicted = electrics.at(T, outputs[0][-self.strained :])
        slopes = np.diag(electrics.alpha) + electrics.strain @ tangents[0][-self.strained :]
        slopes = electrics.R[:, None] * slopes
        there = np.isfinite(values)
        self._update((values - predicted)[there], (slopes @ self._seen)[there], deviation)

    def _update(self, innovation: np.ndarray, H: np.ndarray, deviation: float) -> None:
        if not innovation.size:
            return
        noise = deviation**2 * np.eye(innovation.size)
        K = np.linalg.solve(H @ self._P @ H.T + noise, H @ self._P).T
        n = len(self.x)
        change = K @ innovation
        self.x, self.error = self.x + change[:n], self.error + change[n:]
        left = np.eye(len(change)) - K @ H
        self._P = left @ self._P @ left.T + K @ noise @ K.T


def _start_covariance(heat: HeatModel, deviation: float) -> np.ndarray:
    """Return the covariance (n, n) of the modes after unknown heating of every TCA for each of HEATED_FOR."""
    n = len(heat.A)
    covariance = np.zeros((n, n))
    for duration in HEATED_FOR:
        field = heat.at_knots(duration, 1).G
        field = field / np.diag(heat.C @ field)  # a rise of 1 K of the TCA's own mean
        covariance += deviation**2 / len(HEATED_FOR) * field @ field.T
    return covariance
