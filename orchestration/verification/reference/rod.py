"""The rod's data, its TCA law and section wrench (the paper's Eqs. 4 to 20). Screws are [angular; linear] in the body
frame, SI units; arrays are (component, ...), so that many states are worked on at once.

    xi strain, u_i = lambda + kappa x r_i + r_i',  t_i = u_i/|u_i|,  delta_i = int |u_i| ds - L_i
    N_i = k (delta_i - chi stroke(T_i)),  W = K (xi - xi*) + D xidot + sum N_i [r_i x t_i; t_i]"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Loads", "RodData", "WireLaw", "actuators", "cross", "lengths", "routing", "transposed_ad"]

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])  # of the indices of a cross product


@dataclass(frozen=True)
class WireLaw:
    """Eq. 4 with Castigliano's theorem, pitch angle held; f1 [m/N], f2 [1/N]."""

    length: float  # of the wire [m]
    coiled: float  # length of the coiled actuator [m]
    diameter: float
    coils: float
    twists: float
    E: float
    expansion: float  # of the wire's diameter [1/K]

    @property
    def _G(self) -> float:
        return self.E / 3.0

    @property
    def _J(self) -> float:
        return np.pi * self.diameter**4 / 32

    @property
    def f1(self) -> float:
        sine = self.coiled / self.length
        cosine2, area = 1 - sine**2, np.pi * self.diameter**2 / 4
        R2 = (self.length / (2 * np.pi * self.coils)) ** 2 * cosine2
        bending = R2 * sine**2 / (self.E * self._J / 2) + sine**2 / (self.E * area)
        return self.length * (R2 * cosine2 / (self._G * self._J) + bending + cosine2 / (self._G * area))

    @property
    def f2(self) -> float:
        cosine2 = 1 - (self.coiled / self.length) ** 2
        return self.length * self.length * cosine2 / (2 * np.pi * self.coils * self._G * self._J)

    def stroke(self, rise: np.ndarray) -> np.ndarray:
        """f2 tau [m] at a temperature rise [K] over T_0."""
        swelling = 1 - 1 / (1 + self.expansion * rise)  # 1 - d0/d
        return self.f2 * self._G * self._J * 2 * np.pi * self.twists * swelling / self.length


@dataclass(frozen=True)
class RodData:
    """stiffness, inertia: diagonals of K and Gamma, (6,); rest: xi*, (6,); azimuth, helix: (N,), rad and rad/m."""

    length: float
    stiffness: np.ndarray
    rest: np.ndarray
    inertia: np.ndarray
    retardation: float  # D = retardation K [s]
    offset: float
    azimuth: np.ndarray
    helix: np.ndarray
    tca_stiffness: float  # k = 1/f1 [N/m]
    law: WireLaw | float  # or the free stroke per kelvin [m/K]
    chirality: int
    T_0: float

    @property
    def weight(self) -> float:
        """rho A [kg/m]"""
        return float(self.inertia[5])

    def stroke(self, T: np.ndarray) -> np.ndarray:
        """chi f2 tau(T) [m] for T [K] of any shape."""
        rise = T - self.T_0
        return self.chirality * (self.law.stroke(rise) if isinstance(self.law, WireLaw) else self.law * rise)


@dataclass(frozen=True)
class Loads:
    """At one time, or at B times: T (N,) or (N, B) [K]; gravity [m/s2], force [N], moment [N.m] on the tip in the fixed
    frame, (3,) or (3, B)."""

    T: np.ndarray
    gravity: np.ndarray
    force: np.ndarray
    moment: np.ndarray


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[_NEXT] * b[_LAST] - a[_LAST] * b[_NEXT]


def transposed_ad(screw: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """ad_screw^T wrench, (6, ...)"""
    return -np.concatenate([cross(screw[:3], wrench[:3]) + cross(screw[3:], wrench[3:]), cross(screw[:3], wrench[3:])])


def routing(data: RodData, s: np.ndarray | float) -> np.ndarray:
    """r_i and r_i' of every TCA at s, (2, 3, N, *s.shape)."""
    angle = np.add.outer(data.azimuth, np.zeros_like(s)) + np.multiply.outer(data.helix, s)
    cosine, sine, zero = data.offset * np.cos(angle), data.offset * np.sin(angle), np.zeros_like(angle)
    turn = np.expand_dims(data.helix, tuple(range(1, angle.ndim)))
    return np.stack([[cosine, sine, zero], [-turn * sine, turn * cosine, zero]])


def actuators(path: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of every TCA whose routing is path (2, 3, N, *places), at strains xi (6, *places, ...): |u_i| (N, *places, ...)
    and its gradient [r_i x t_i; t_i] (6, N, *places, ...)."""
    r, slope = path.reshape(*path.shape, *(1,) * (xi.ndim + 2 - path.ndim))
    wide = xi[:, None]
    u = wide[3:] + cross(wide[:3], r) + slope
    size = np.sqrt((u * u).sum(axis=0))
    t = u / size
    return size, np.concatenate([cross(r, t), t])


def lengths(data: RodData) -> np.ndarray:
    """L_i of the unloaded rod, (N,)."""
    return data.length * actuators(routing(data, 0.0), data.rest)[0]
