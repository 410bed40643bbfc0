"""Parameters of the rod, law of the TCAs, wrench of the section.

    xi = [kappa; lambda],  u_i = lambda + kappa x r_i + r_i',  t_i = u_i/|u_i|          (Eqs. 9 to 13)
    delta_i = int |u_i| ds - L_i                                                        (Eq. 17)
    N_i = k (delta_i - chi f2 tau(T_i)),  k = 1/f1                                      (Eq. 4)
    W = K (xi - xi*) + D xidot + sum N_i [r_i x t_i; t_i]                               (Eq. 14, signs corrected)

Screws are [angular; linear] in the body frame, SI units. The first index of an array is the component, so that many
states are processed at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Loads", "RodData", "WireLaw", "actuators", "cross", "lengths", "per_tca", "routing", "transposed_ad"]

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])  # cyclic indices of a cross product


@dataclass(frozen=True)
class WireLaw:
    """Law of a TCA (Eq. 4) by Castigliano's theorem with a constant pitch angle."""

    length: float  # of the wire [m]
    coiled: float  # length of the coiled actuator [m]
    diameter: float  # of the wire [m]
    coils: float
    twists: float
    E: float  # Young's modulus of the wire [Pa]
    expansion: float  # rho_T of the wire's diameter [1/K]

    @property
    def _G(self) -> float:
        return self.E / 3.0

    @property
    def _J(self) -> float:
        return np.pi * self.diameter**4 / 32

    @property
    def f1(self) -> float:
        """Compliance [m/N]."""
        sine = self.coiled / self.length
        cosine2, area = 1 - sine**2, np.pi * self.diameter**2 / 4
        R2 = (self.length / (2 * np.pi * self.coils)) ** 2 * cosine2
        bending = R2 * sine**2 / (self.E * self._J / 2) + sine**2 / (self.E * area)
        return self.length * (R2 * cosine2 / (self._G * self._J) + bending + cosine2 / (self._G * area))

    @property
    def f2(self) -> float:
        """Displacement per torque of the untwisting wire [1/N]."""
        cosine2 = 1 - (self.coiled / self.length) ** 2
        return self.length * self.length * cosine2 / (2 * np.pi * self.coils * self._G * self._J)

    def stroke(self, rise: np.ndarray) -> np.ndarray:
        """Free stroke f2 tau [m] at a temperature rise [K] over T_0."""
        swelling = 1 - 1 / (1 + self.expansion * rise)  # 1 - d0/d
        return self.f2 * self._G * self._J * 2 * np.pi * self.twists * swelling / self.length


@dataclass(frozen=True)
class RodData:
    """Parameters of a rod with N TCAs, SI units."""

    length: float
    stiffness: np.ndarray  # diagonal of K, (6,)
    rest: np.ndarray  # strain xi* of the unloaded rod, (6,)
    inertia: np.ndarray  # diagonal of Gamma, (6,)
    retardation: float  # [s], D = retardation K
    offset: np.ndarray  # (N,)
    azimuth: np.ndarray  # (N,) [rad]
    helix: np.ndarray  # (N,) [rad/m]
    tca_stiffness: np.ndarray  # k = 1/f1, (N,) [N/m]
    laws: tuple[WireLaw | float, ...]  # of the TCAs; a number is the free stroke per kelvin [m/K]
    chirality: np.ndarray  # (N,)
    T_0: float

    @property
    def weight(self) -> float:
        """Mass per length rho A [kg/m]."""
        return float(self.inertia[5])

    def stroke(self, T: np.ndarray) -> np.ndarray:
        """Free strokes with their signs, chi f2 tau(T) [m], for T (N, ...) [K]."""
        rise = np.asarray(T) - self.T_0
        strokes = [
            law.stroke(own) if isinstance(law, WireLaw) else law * own for law, own in zip(self.laws, rise, strict=True)
        ]
        return per_tca(self.chirality, rise.ndim) * np.array(strokes)

    def tensions(self, delta: np.ndarray, T: np.ndarray) -> np.ndarray:
        """Tensions N_i = k_i (delta_i - chi f2 tau) [N] of displacements (N, ...) [m] at T (N, ...) [K]."""
        return per_tca(self.tca_stiffness, np.ndim(delta)) * (delta - self.stroke(T))


@dataclass(frozen=True)
class Loads:
    """Loads at one time, or at B times in a second axis; vectors in the fixed frame."""

    T: np.ndarray  # (N,) [K]
    gravity: np.ndarray  # (3,) [m/s2]
    force: np.ndarray  # on the tip, (3,) [N]
    moment: np.ndarray  # on the tip, (3,) [N.m]


def per_tca(values: np.ndarray, ndim: int) -> np.ndarray:
    """Values (N,) as an array of that many axes, the first of them the TCAs'."""
    return np.asarray(values).reshape(-1, *(1,) * (ndim - 1))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product over the first axis."""
    return a[_NEXT] * b[_LAST] - a[_LAST] * b[_NEXT]


def transposed_ad(screw: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Product ad_screw^T wrench of Eq. 8, (6, ...)."""
    return -np.concatenate([cross(screw[:3], wrench[:3]) + cross(screw[3:], wrench[3:]), cross(screw[:3], wrench[3:])])


def routing(data: RodData, s: np.ndarray | float) -> np.ndarray:
    """Position r_i and derivative r_i' of every TCA in the section at s, (2, 3, N, *s.shape)."""
    angle = np.add.outer(data.azimuth, np.zeros_like(s)) + np.multiply.outer(data.helix, s)
    offset = np.expand_dims(data.offset, tuple(range(1, angle.ndim)))
    cosine, sine, zero = offset * np.cos(angle), offset * np.sin(angle), np.zeros_like(angle)
    turn = np.expand_dims(data.helix, tuple(range(1, angle.ndim)))
    return np.stack([[cosine, sine, zero], [-turn * sine, turn * cosine, zero]])


def actuators(path: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stretch |u_i| of every TCA and its gradient [r_i x t_i; t_i] with respect to the strain.

    Parameters
    ----------
    path : ndarray
        Output of `routing`, (2, 3, N, *stations).
    xi : ndarray
        Strains (6, *stations, ...).

    Returns
    -------
    tuple of ndarray
        Stretch (N, *stations, ...) and gradient (6, N, *stations, ...).
    """
    r, slope = path.reshape(*path.shape, *(1,) * (xi.ndim + 2 - path.ndim))
    wide = xi[:, None]
    u = wide[3:] + cross(wide[:3], r) + slope
    size = np.sqrt((u * u).sum(axis=0))
    t = u / size
    return size, np.concatenate([cross(r, t), t])


def lengths(data: RodData) -> np.ndarray:
    """Lengths L_i of the TCAs in the unloaded rod [m], (N,)."""
    return data.length * actuators(routing(data, 0.0), data.rest)[0]
