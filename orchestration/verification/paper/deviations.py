"""Deviations of a result from the values read off the paper.

The positions of the tip deviate more than the angles explain. A body of length L (1 + e) whose curvature is constant
and whose end is turned by theta has its tip at the distance

    r = L (1 + e) (1 - cos theta)/theta

from the axis: without loads the strain is constant along the rod whatever the temperatures are. The angles of the paper
give theta, so every position of its tip implies an elongation e = r theta/(L (1 - cos theta)) - 1 of its own.

These elongations, 14 to 20 %, exceed the mean free stroke of the TCAs, sum c_i/(3 L) = 7 to 15 %, which bounds e for
every stiffness of body and TCAs, and they do not grow with the temperature as a stroke does. Two other causes each
leave less than the reading error of 0.5 mm in all distances r: a body (or a scale of the figure) that is 8 % longer, or
a curvature that is 28 % above its mean at the clamp and 28 % below it at the tip. The readings do not tell which.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from .data import ANGLES, TEMPERATURES, TipReading, readings, tip_readings

__all__ = ["Deviations", "TipComparison", "compare_tips", "deviations", "time_course"]

_LENGTH = 40.0  # [mm] length L of the paper's body
_MILLI = 1e3


@dataclass(frozen=True)
class Deviations:
    """Root mean squares over all sharp points of a scene."""

    temperature: float  # [K]
    angle: float  # [rad]


@dataclass(frozen=True)
class TipComparison:
    """Position of the tip at one time in the paper and in a result, in the top view."""

    read: TipReading
    computed: np.ndarray  # (2,) [mm]
    from_angles: np.ndarray  # (2,) [mm] where the paper's own angles put a tip with the computed elongation
    elongation: float  # e of the result
    elongation_read: float  # e that the paper's position and angles imply together

    @property
    def distance(self) -> float:
        """Distance between the two positions [mm]."""
        return float(np.hypot(*(self.computed - [self.read.x, self.read.y])))

    @property
    def distance_from_angles(self) -> float:
        """Distance that is left [mm] where the result has the paper's angles."""
        return float(np.hypot(*(self.from_angles - [self.read.x, self.read.y])))


def time_course(result: xr.Dataset, series: str) -> np.ndarray:
    """Quantity of the figure in a result, at its times: temperature [degC] or angle [rad]."""
    if series in TEMPERATURES:
        return result["thermal.T"].to_numpy()[:, TEMPERATURES.index(series)] - 273.15
    return -result["rod.tip.euler"].to_numpy()[:, ANGLES.index(series)]


def deviations(result: xr.Dataset, scene: str) -> Deviations:
    """Compare the temperatures and angles of a result with the paper's."""
    time = result["time"].to_numpy()
    points = {series: reading.sharp() for series, reading in readings(scene).items()}
    off = {series: np.interp(p.time, time, time_course(result, series)) - p.value for series, p in points.items()}
    temperature, angle = (np.concatenate([off[series] for series in group]) for group in (TEMPERATURES, ANGLES))
    return Deviations(float(np.sqrt(np.mean(temperature**2))), float(np.sqrt(np.mean(angle**2))))


def compare_tips(result: xr.Dataset, scene: str) -> list[TipComparison]:
    """Compare the positions of the tip of a result with the paper's."""
    return [_compare_tip(result, scene, read) for read in tip_readings(scene)]


def _compare_tip(result: xr.Dataset, scene: str, read: TipReading) -> TipComparison:
    time, curves = result["time"].to_numpy(), readings(scene)
    computed = _MILLI * np.array([np.interp(read.time, time, result["rod.tip.p"].to_numpy()[:, k]) for k in (0, 1)])
    ours = _unit_tip(np.array([np.interp(read.time, time, time_course(result, series)) for series in ANGLES]))
    paper = _unit_tip(np.array([curves[series].at(read.time) for series in ANGLES]))
    elongation = float(np.hypot(*computed) / np.hypot(*ours)) / _LENGTH - 1.0
    return TipComparison(
        read=read,
        computed=computed,
        from_angles=_LENGTH * (1.0 + elongation) * paper,
        elongation=elongation,
        elongation_read=float(np.hypot(read.x, read.y) / np.hypot(*paper)) / _LENGTH - 1.0,
    )


def _unit_tip(angles: np.ndarray) -> np.ndarray:
    """Position of the tip (2,) of an arc of length 1 that leaves along z and ends with the figure's angles [rad]."""
    x, y, z = Rotation.from_euler("XYZ", -angles).as_matrix()[:, 2]
    theta = float(np.arccos(z))
    return (1.0 - z) / theta * np.array([x, y]) / np.hypot(x, y)
