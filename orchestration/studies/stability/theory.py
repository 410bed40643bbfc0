"""Loop gain of the straight rod and its TCAs, linear and exact in space: the factor of an error per sweep.

A guess delta_i acts as tension -k delta_i, a force along the rod and a moment across it at its end; the rod answers
with a stretch and a rotation there, seen by TCA j at e_j r from the axis:

    delta_j = -k sum_i [F(s) + r^2 e_i.e_j B(s)] delta_i,    F = (L/EA) tanh(z)/z,  z = s L sqrt(rho/E)

with B(s) the rotation of a Timoshenko beam's end per end moment. One backward Euler step of length H answers as the
Laplace transform does at s = 1/H: quasi-static for long steps (F -> L/EA, B -> L/EI), stiff with inertia for short
ones. For one mode of frequency omega alone the factor is 1/(1 + 1/(omega H)^2).

Explicit coupling lags one step: an error that alternates, e_n = (-1)^n e, meets the rod at s = (1 - (-1))/H = 2/H.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ...scene.body import SegmentParameters

__all__ = ["LIMITS", "Beam", "stability_limit"]

# Gain above which a method fails; for explicit coupling at half the macro step, where the extrapolation of an
# alternating error has the factor 1 (held) or 2 + 1 (a line).
LIMITS: Mapping[tuple[str, str], float] = {
    ("none", "held"): 1.0,
    ("none", "linear"): 1.0 / 3.0,
    ("plain", "linear"): 1.0,
}


@dataclass(frozen=True)
class Beam:
    """A round body with TCAs parallel to its axis; SI units."""

    body: SegmentParameters  # its only segment; without stiffness and curvature
    offset: float  # [m] of the TCAs from the axis
    azimuths: tuple[float, ...]  # [rad] of the TCAs
    dynamic: bool

    @property
    def area(self) -> float:
        """Area of the cross-section [m2]."""
        return math.pi * self.body.radius**2

    @property
    def stiffness(self) -> float:
        """Axial stiffness EA/L of the body [N/m]."""
        return self.body.E * self.area / self.body.length

    def gain(self, step: float, stiffness: float) -> float:
        """Spectral radius of the error map of one sweep, for a macro step [s] and TCAs of that stiffness [N/m]."""
        s = 1.0 / step if self.dynamic else 0.0
        e = np.array([[math.cos(a), math.sin(a)] for a in self.azimuths])
        answers = self._stretch(s) + self.offset**2 * (e @ e.T) * self._rotation(s)
        return float(stiffness * np.abs(np.linalg.eigvals(answers)).max())

    def _stretch(self, s: float) -> float:
        """Axial compliance F(s) [m/N]; Kelvin-Voigt damping multiplies the stiffness by 1 + retardation s."""
        soft = 1.0 / (1.0 + self.body.retardation * s)
        z = s * self.body.length * math.sqrt(self.body.rho * soft / self.body.E)
        return soft / self.stiffness * (math.tanh(z) / z if z else 1.0)

    def _rotation(self, s: float) -> float:
        """Rotational compliance B(s) [1/(N m)] of a Timoshenko beam.

        w' = theta + Q/(ks G A), theta' = M/(E I), M' = -Q + rho I s^2 theta, Q' = rho A s^2 w, clamped at 0, Q = 0 at
        L. Lengths are in units of L, so that the exponential is well scaled.
        """
        stiffening = 1.0 + self.body.retardation * s
        EI = self.body.E * stiffening * math.pi * self.body.radius**4 / 4.0
        GA = self.body.shear_factor * self.body.E * stiffening * self.area / (2.0 * (1.0 + self.body.nu))
        L = self.body.length
        inertia = self.body.rho * self.area * s**2
        system = np.zeros((4, 4))  # of w/L, theta, M L/EI, Q L^2/EI
        system[0, 1], system[0, 3] = 1.0, EI / (GA * L**2)
        system[1, 2] = 1.0
        system[2, 1], system[2, 3] = inertia * self.body.radius**2 / 4.0 * L**2 / EI, -1.0
        system[3, 0] = inertia * L**4 / EI
        end = expm(system)[:, 2:]  # the clamp leaves moment and shear force there unknown
        at_clamp = np.linalg.solve(end[2:], [L / EI, 0.0])
        return float(end[1] @ at_clamp)


def stability_limit(beam: Beam, steps: np.ndarray, method: str, waveform: str, omega: float) -> np.ndarray:
    """Stiffness ratio k_tca/(EA/L) above which a method fails, for macro steps (n,) [s]; nan where it never does.

    omega: factor of constant relaxation, which converges below the gain 2/omega - 1.
    """
    threshold = 2.0 / omega - 1.0 if method == "relaxed" else LIMITS.get((method, waveform), math.nan)
    share = 0.5 if method == "none" else 1.0
    return np.array([threshold / beam.gain(share * step, beam.stiffness) for step in steps])
