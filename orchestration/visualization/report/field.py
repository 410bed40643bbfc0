"""The temperature field of the cross-section over time, for the eye. A result holds means; the field follows from the
powers by solving the heat equation once more, with the finite elements of `reference` and nothing of the FMU. `gap`
says how far the means of this field are from those of the result: it checks either.

    P_i(t) = V_i(t)^2 / (R_i [1 + alpha_T (T_i(t) - T_ref) + beta delta_i(t)/L])

V from the scene's signals where it is one, else, as T, delta and T_ambient, interpolated between the result's rows.

A page needs few numbers: field(t) = T_0 + modes c(t), the left singular vectors c orthonormal."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from ...cosim import signals
from ...verification.reference.heat import HeatData, Matrices
from ...verification.reference.inputs import Inputs, heat_data_from
from ...verification.reference.radau import NODES, LinearRadau
from ...verification.reference.section import Section
from ..geometry import Surface
from ..manipulator import members, thermal_parameters

__all__ = ["Field", "field"]

_EDGE = 0.07  # of the mesh, share of the body's radius
_RASTER = 101  # points along each axis of the picture
_KEPT = 0.02  # [K] that a compressed value may be off


@dataclass(frozen=True)
class Field:
    """section: geometry; courses (time, r) [K]; raster (_RASTER, _RASTER, r): modes on a square grid over the section,
    rows along y, continued outwards where there is no material; cap: the section as triangles, and cap_modes (n, r) at
    its corners; T_0 [K]; gap [K]: largest difference of TCA means from the result's."""

    section: Section
    T_0: float
    courses: np.ndarray
    raster: np.ndarray
    cap: Surface
    cap_modes: np.ndarray
    gap: float

    @property
    def axis(self) -> np.ndarray:
        """(_RASTER,) [m]: places of the raster along x and along y."""
        return self.section.radius * np.linspace(-1.0, 1.0, _RASTER)

    def at(self, row: int) -> np.ndarray:
        """(_RASTER, _RASTER) [K]"""
        return self.T_0 + self.raster @ self.courses[row]


def field(result: xr.Dataset, heat: str, rows: np.ndarray, station: int) -> Field:
    """heat: the member that is the heat model; rows: of the result, from its start; station: of the cap."""
    data = heat_data_from(thermal_parameters(result, heat))
    m = Matrices(data, _EDGE * data.section.radius)
    rises = _solve(result, heat, rows, data, m)
    means = data.T_0 + rises @ m.means.T
    gap = float(np.abs(means - result[f"{heat}.T"].to_numpy()[rows]).max())
    squares, left = np.linalg.eigh(rises @ rises.T)  # of the singular values, rising
    courses = left[:, int((squares[:-1] < _KEPT**2).sum()) :]  # no value is further off than the first left out
    modes = rises.T @ courses
    corners = int(m.triangles.max()) + 1
    cap = Surface(m.coordinates[:corners], np.full(corners, station), m.triangles)
    return Field(
        data.section, data.T_0, courses, _raster(m.coordinates, modes, data.section.radius), cap, modes[:corners], gap
    )


def _solve(result: xr.Dataset, heat: str, rows: np.ndarray, data: HeatData, m: Matrices) -> np.ndarray:
    """Temperature rises since T_0 (row, unknown) [K]."""
    times = result["time"].to_numpy()[rows]
    power = _powers(result, heat, data)
    outside = _interpolated(result, f"{heat}.T_ambient")
    integrate = LinearRadau(m.mass, m.stiffness)
    rises = np.zeros((times.size, m.surface.size))
    for k, (a, b) in enumerate(pairwise(times)):
        stages = a + NODES * (b - a)
        loads = [power(t, a, b) / data.length @ m.means + (outside(t) - data.T_0) * m.surface for t in stages]
        rises[k + 1] = integrate.step(rises[k], b - a, np.array(loads))[0][-1]
    return rises


def _powers(result: xr.Dataset, heat: str, data: HeatData) -> Callable[[float, float, float], np.ndarray]:
    """power(t, a, b) [W] (N,) at t in the step from a to b."""
    beta, known = thermal_parameters(result, heat).beta, members(result)[heat]["signals"]
    volts, T, delta = (_interpolated(result, f"{heat}.{name}") for name in ("V", "T", "delta"))
    driven = [i for i in range(len(data.resistance)) if f"V[{i + 1}]" in known]
    given = Inputs(tuple(_signal(*known[f"V[{i + 1}]"]) for i in driven))

    def power(t: float, a: float, b: float) -> np.ndarray:
        V = volts(t)
        V[driven] = given(t, a, b)
        change = data.alpha * (T(t) - data.T_ref) + beta * delta(t) / data.length
        return V**2 / (np.array(data.resistance) * (1.0 + change))

    return power


def _signal(kind: str, values: Mapping[str, Any]) -> signals.Signal:
    return getattr(signals, kind)(**values)


def _interpolated(result: xr.Dataset, name: str) -> Callable[[float], np.ndarray]:
    """(n,) at a time"""
    times, columns = result["time"].to_numpy(), result[name].to_numpy().reshape(result.sizes["time"], -1).T
    return lambda t: np.array([np.interp(t, times, column) for column in columns])


def _raster(places: np.ndarray, modes: np.ndarray, radius: float) -> np.ndarray:
    axis = radius * np.linspace(-1.0, 1.0, _RASTER)
    x, y = np.meshgrid(axis, axis)
    found = NearestNDInterpolator(places, modes)(x, y)
    inside = np.hypot(x, y) < 0.99 * radius
    found[inside] = LinearNDInterpolator(places, modes)(x[inside], y[inside])
    return found
