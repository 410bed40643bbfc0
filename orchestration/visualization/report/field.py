"""Temperature field of the cross-section over time.

A result contains area means only. The field follows from the powers by solving Eqs. 1 to 3 again with the finite
elements of the reference solution; nothing of the FMU is used. `gap` is the largest difference between the means of
this field and those of the result: a check of both.

    P_i(t) = V_i(t)^2 / (R_i [1 + alpha_T (T_i(t) - T_ref) + beta delta_i(t)/L])

V is evaluated from the scene's signals where there are any; otherwise, like T, delta and T_ambient, it is interpolated
between the rows of the result. A singular value decomposition compresses the field for the page: field(t) = T_0 + modes
c(t) with orthonormal time courses c.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from ...cosim import signals
from ...scene.manipulator import ThermalParameters
from ...verification.reference.heat import Matrices
from ...verification.reference.inputs import Inputs
from ...verification.reference.radau import NODES, LinearRadau
from ...verification.reference.section import Section
from ..manipulator import members, thermal_parameters

__all__ = ["Field", "field"]

_EDGE = 0.07  # edge length of the mesh as a fraction of the body's radius
_RASTER = 81  # points along each axis of the raster
_COMPRESSION_ERROR = 0.02  # [K] allowed in a compressed value


@dataclass(frozen=True)
class Field:
    """Temperature field, compressed to r modes."""

    section: Section
    T_0: float  # [K]
    courses: np.ndarray  # time courses of the modes (time, r) [K]
    raster: np.ndarray  # modes on a square grid, rows along y, continued into holes (_RASTER, _RASTER, r)
    extremes: np.ndarray  # lowest and highest temperature of all times [K], (2,)
    gap: float  # [K] largest difference of the TCAs' means from those of the result

    @property
    def axis(self) -> np.ndarray:
        """Coordinates of the raster along x and along y [m], (_RASTER,)."""
        return self.section.radius * np.linspace(-1.0, 1.0, _RASTER)

    def at(self, row: int) -> np.ndarray:
        """Temperatures of one row of the result on the raster [K], (_RASTER, _RASTER)."""
        return self.T_0 + self.raster @ self.courses[row]


def field(result: xr.Dataset, heat: str, rows: np.ndarray) -> Field:
    """Solve for the temperature field.

    Parameters
    ----------
    heat : str
        Name of the member that is the heat model.
    rows : ndarray
        Rows of the result at which the field is stored, the first of them its start.
    """
    data = thermal_parameters(result, heat)
    m = Matrices(data, _EDGE * data.geometry.radius)
    rises = _solve(result, heat, rows, data, m)
    means = data.T_0 + rises @ m.means.T
    gap = float(np.abs(means - result[f"{heat}.T"].to_numpy()[rows]).max())
    squares, left = np.linalg.eigh(rises @ rises.T)  # squares of the singular values, in rising order
    courses = left[:, int((squares[:-1] < _COMPRESSION_ERROR**2).sum()) :]  # bounded by the first mode left out
    modes = rises.T @ courses
    extremes = data.T_0 + np.array([rises.min(), rises.max()])
    raster = _raster(m.coordinates, modes, data.geometry.radius)
    return Field(Section.of(data), data.T_0, courses, raster, extremes, gap)


def _solve(result: xr.Dataset, heat: str, rows: np.ndarray, data: ThermalParameters, m: Matrices) -> np.ndarray:
    """Integrate the temperature rises since T_0 (row, unknown) [K]."""
    times = result["time"].to_numpy()[rows]
    power = _powers(result, heat, data)
    outside = _interpolated(result, f"{heat}.T_ambient")
    integrate = LinearRadau(m.mass, m.stiffness)
    rises = np.zeros((times.size, m.surface.size))
    for k, (a, b) in enumerate(pairwise(times)):
        stages = a + NODES * (b - a)
        loads = [power(t, a, b) / data.geometry.length @ m.means + (outside(t) - data.T_0) * m.surface for t in stages]
        rises[k + 1] = integrate.step(rises[k], b - a, np.array(loads))[0][-1]
    return rises


def _powers(result: xr.Dataset, heat: str, data: ThermalParameters) -> Callable[[float, float, float], np.ndarray]:
    """Powers (N,) [W] as a function (t, a, b) of the time t in the step from a to b."""
    known = members(result)[heat]["signals"]
    volts, T, delta = (_interpolated(result, f"{heat}.{name}") for name in ("V", "T", "delta"))
    driven = [i for i in range(len(data.resistance)) if f"V[{i + 1}]" in known]
    given = Inputs(tuple(_signal(*known[f"V[{i + 1}]"]) for i in driven))

    def power(t: float, a: float, b: float) -> np.ndarray:
        V = volts(t)
        V[driven] = given(t, a, b)
        change = np.array(data.alpha) * (T(t) - data.T_ref) + np.array(data.beta) * delta(t) / data.geometry.length
        return V**2 / (np.array(data.resistance) * (1.0 + change))

    return power


def _signal(kind: str, values: Mapping[str, Any]) -> signals.Signal:
    return getattr(signals, kind)(**values)


def _interpolated(result: xr.Dataset, name: str) -> Callable[[float], np.ndarray]:
    """Interpolate a quantity of the result: its elements (n,) as a function of time."""
    times, columns = result["time"].to_numpy(), result[name].to_numpy().reshape(result.sizes["time"], -1).T
    return lambda t: np.array([np.interp(t, times, column) for column in columns])


def _raster(points: np.ndarray, modes: np.ndarray, radius: float) -> np.ndarray:
    """Interpolate modes (n, r) at points (n, 2) on the raster, (_RASTER, _RASTER, r)."""
    axis = radius * np.linspace(-1.0, 1.0, _RASTER)
    x, y = np.meshgrid(axis, axis)
    raster = NearestNDInterpolator(points, modes)(x, y)
    inside = np.hypot(x, y) < 0.99 * radius
    raster[inside] = LinearNDInterpolator(points, modes)(x[inside], y[inside])
    return raster
