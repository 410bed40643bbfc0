"""Heat in the cross-section by quadratic finite elements of scikit-fem, in time by Radau IIA.

    rho c dT/dt = div(k grad T) + q                                                     (Eq. 1)
    q = V_i^2/(R_i L A_tca) in annulus i, 0 in the body                                 (Eq. 2, as a power per volume)
    -k dT/dn = h (T - T_inf) on the surface, 0 on the bores                             (Eq. 3, sign corrected)
    R_i = R_ref,i [1 + alpha_T,i (T_i - T_ref) + shift_i(t)]

Everything is per metre of the body's length; temperatures in K. The paper neglects the change of R_i.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from skfem import Basis, BilinearForm, ElementTriP2, FacetBasis, LinearForm
from skfem.helpers import dot, grad

from ...scene.manipulator import ThermalParameters
from .radau import NODES, LinearRadau
from .section import Section, triangulate

__all__ = ["HeatCourse", "Matrices", "SmoothPiece", "heat"]

_HALVINGS = 7  # the first step after a jump is 2^-7 of the regular one: it resolves the thin thermal layer


@dataclass(frozen=True)
class SmoothPiece:
    """Stretch of time between two jumps of an input."""

    end: float  # [s]
    T: CubicHermiteSpline  # (N,) [K] over time


@dataclass(frozen=True)
class HeatCourse:
    """Time courses of n output times and N TCAs. Where a voltage jumps, P is the value before the jump."""

    times: np.ndarray  # (n,) [s]
    T: np.ndarray  # (n, N) [K], area means of the annuli
    P: np.ndarray  # (n, N) [W]
    stored: np.ndarray  # (n,) [J], heat stored since T_0
    loss: np.ndarray  # (n,) [W], through the surface
    pieces: tuple[SmoothPiece, ...]
    unknowns: int  # of the mesh

    def temperature(self, t: float, within: float) -> np.ndarray:
        """Interpolate the temperatures (N,) [K] at t between the steps; `within` is a time inside the piece meant."""
        piece = next((p for p in self.pieces if within <= p.end), self.pieces[-1])
        return piece.T(t)


@BilinearForm
def _conduction(u, v, w):
    return dot(grad(u), grad(v))


@BilinearForm
def _product(u, v, w):
    return u * v


@LinearForm
def _sum(v, w):
    return v


class Matrices:
    """Matrices of M T' + K T = P/L @ means + T_inf surface, per metre of the body's length.

    Attributes
    ----------
    mass, stiffness : csc_matrix
        M and K, (n, n); K includes convection at the surface.
    means : ndarray
        Area means over the annuli, (N, n).
    surface : ndarray
        Convection [W/(m.K)], (n,).
    capacity : ndarray
        Heat capacity [J/(m.K)], (n,).
    coordinates : ndarray
        Positions of the unknowns [m], (n, 2); the corners of the mesh come first.
    triangles : ndarray
        Indices of the corners, (m, 3).
    """

    def __init__(self, data: ThermalParameters, edge: float) -> None:
        mesh = triangulate(Section.of(data), edge)
        tcas = [mesh.subdomains[f"tca{i}"] for i in range(len(data.geometry.azimuth))]
        body = np.setdiff1d(np.arange(mesh.nelements), np.concatenate(tcas))
        element = ElementTriP2()
        inside = [
            (Basis(mesh, element, elements=part, intorder=4), k, rho_c)
            for part, k, rho_c in zip(tcas, data.tca_k, data.tca_rho_c, strict=True)
        ]
        parts = [*inside, (Basis(mesh, element, elements=body, intorder=4), data.body_k, data.body_rho_c)]
        surface = FacetBasis(mesh, element, facets="outer", intorder=4)
        self.mass = sum(rho_c * _product.assemble(basis) for basis, _, rho_c in parts)
        self.stiffness = sum(k * _conduction.assemble(basis) for basis, k, _ in parts)
        self.stiffness = self.stiffness + data.transfer * _product.assemble(surface)
        means = np.array([_sum.assemble(basis) for basis, _, _ in inside])
        self.means = means / means.sum(axis=1, keepdims=True)
        self.surface = data.transfer * _sum.assemble(surface)
        self.capacity = self.mass @ np.ones(self.surface.size)
        self.coordinates, self.triangles = Basis(mesh, element).doflocs.T, mesh.t[:3].T


def heat(
    data: ThermalParameters,
    voltage: Callable[[float, float, float], np.ndarray],
    ambient: Callable[[float, float, float], float],
    pieces: Sequence[np.ndarray],
    edge: float = 0.2e-3,
    step: float = 0.1,
    matrices: Matrices | None = None,
    shift: Callable[[float], np.ndarray | float] = lambda t: 0.0,
) -> HeatCourse:
    """Solve Eqs. 1 to 3 from T_0.

    Parameters
    ----------
    voltage, ambient : callable
        (t, a, b) -> voltages [V] (N,), ambient temperature [K], at time t of the step from a to b, in which they are
        smooth.
    pieces : sequence of ndarray
        Output times [s], one array for each stretch between jumps, from its start to its end.
    edge : float
        Edge length [m] of the mesh; not used where `matrices` are given.
    step : float
        Longest step [s].
    shift : callable
        t -> relative change (N,) of the resistances by other causes than temperature; smooth within a step.
    """
    m = matrices or Matrices(data, edge)
    integrate = LinearRadau(m.mass, m.stiffness)
    R, T = np.array(data.resistance), np.full(m.surface.size, data.T_0)
    first = _power(voltage(pieces[0][0], *pieces[0][:2]), R, data, m.means @ T, shift(pieces[0][0]))
    rows, splines = [_row(pieces[0][0], T, first, ambient(pieces[0][0], *pieces[0][:2]), m, data)], []
    for marks in pieces:
        knots, values, slopes = [marks[0]], [m.means @ T], list[np.ndarray]()
        for a, b in _steps(marks, step):
            T, slope, power = _advance(T, a, b, voltage, ambient, R, m, integrate, data, shift)
            knots.append(b)
            values.append(m.means @ T)
            slopes += [slope[-1]] if slopes else [_extrapolated(slope, b - a), slope[-1]]
            if b in marks:
                rows.append(_row(b, T, power, ambient(b, a, b), m, data))
        splines.append(SmoothPiece(marks[-1], CubicHermiteSpline(knots, np.array(values), np.array(slopes))))
    times, means, powers, stored, loss = (np.array(column) for column in zip(*rows, strict=True))
    return HeatCourse(times, means, powers, stored, loss, tuple(splines), T.size)


def _advance(T, a, b, voltage, ambient, R, m: Matrices, integrate: LinearRadau, data: ThermalParameters, shift):
    """Advance T from a to b: T at b, slopes of the means at the three stages, powers at b.

    The resistances depend on the temperatures at the stages, so the step is iterated until the powers agree.
    """
    times = a + NODES * (b - a)
    volts = np.array([voltage(t, a, b) for t in times])
    outside = np.array([ambient(t, a, b) for t in times])
    shifts = np.array([shift(t) + np.zeros_like(R) for t in times])
    means = np.tile(m.means @ T, (3, 1))
    while True:
        power = _power(volts, R, data, means, shifts)
        load = power / data.geometry.length @ m.means + outside[:, None] * m.surface
        stages, slopes = integrate.step(T, b - a, load)
        means = stages @ m.means.T
        if np.abs(_power(volts, R, data, means, shifts) - power).max() <= 1e-12 * np.abs(power).max():
            return stages[-1], slopes @ m.means.T, power[-1]


def _power(
    volts: np.ndarray, R: np.ndarray, data: ThermalParameters, means: np.ndarray, shift: np.ndarray | float
) -> np.ndarray:
    return volts**2 / (R * (1.0 + np.array(data.alpha) * (means - data.T_ref) + shift))


def _row(t: float, T: np.ndarray, power: np.ndarray, outside: float, m: Matrices, data: ThermalParameters):
    stored = data.geometry.length * float(m.capacity @ (T - data.T_0))
    return t, m.means @ T, power, stored, data.geometry.length * float(m.surface @ (T - outside))


def _extrapolated(slopes: np.ndarray, h: float) -> np.ndarray:
    """Extrapolate the slope at the start of a step from its stages by the collocation polynomial."""
    return np.linalg.solve(np.vander(NODES, increasing=True), slopes)[0]


def _steps(marks: np.ndarray, longest: float) -> list[tuple[float, float]]:
    """Divide the time between the marks into steps not above `longest`, the first of them halved repeatedly.

    A jump of the power starts with a thin thermal layer, which needs short steps.
    """
    edges = [float(marks[0])]
    for a, b in pairwise(marks):
        count = max(1, int(np.ceil((b - a) / longest - 1e-9)))
        edges += [*np.linspace(a, b, count + 1)[1:-1].tolist(), float(b)]
    first = edges[1] - edges[0]
    edges[1:1] = [edges[0] + first * 0.5**k for k in range(_HALVINGS, 0, -1)]
    return list(pairwise(edges))
