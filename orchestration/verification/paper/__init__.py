"""The three scenes of Pawlowski, Sun, Xu, Liu, Zhao (CDC 2018) against values read off their Fig. 3.

fig3.csv: temperatures [degC] and angles [rad] over time; tip.csv: tip positions [mm]. The angles of the figure are
(YZ, XZ, XY) = -(alpha, beta, gamma) of the tip, R = Rx(alpha) Ry(beta) Rz(gamma).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

__all__ = ["ANGLES", "SCENES", "TEMPERATURES", "Reading", "course", "deviations", "readings", "tips"]

SCENES = ("step", "switch", "sine")
TEMPERATURES = ("T1", "T2", "T3")
ANGLES = ("YZ", "XZ", "XY")
BLURRED_START = 0.6  # [s] the line width hides what happens before
BLURRED_SWITCH = 0.3  # [s] and on both sides of the switch
SWITCH = 15.0  # [s]


@dataclass(frozen=True)
class Reading:
    """Points read off one curve."""

    time: np.ndarray  # [s]
    value: np.ndarray  # [degC] or [rad]

    def sharp(self) -> Reading:
        """Without the points that the line width blurs."""
        keep = (self.time > BLURRED_START) & (np.abs(self.time - SWITCH) > BLURRED_SWITCH)
        return Reading(self.time[keep], self.value[keep])


def readings(scene: str) -> dict[str, Reading]:
    """Series (T1..T3, YZ, XZ, XY) -> points."""
    rows = [row for row in _rows("fig3.csv") if row["scene"] == scene]
    return {
        series: Reading(
            np.array([float(row["t_s"]) for row in rows if row["series"] == series]),
            np.array([float(row["value"]) for row in rows if row["series"] == series]),
        )
        for series in (*TEMPERATURES, *ANGLES)
    }


def tips(scene: str) -> np.ndarray:
    """Points (n, 3): t [s], x [mm], y [mm]."""
    return np.array(
        [[float(row[key]) for key in ("t_s", "x_mm", "y_mm")] for row in _rows("tip.csv") if row["scene"] == scene]
    )


def course(result: xr.Dataset, series: str) -> np.ndarray:
    """What the figure shows of a result, at its times: temperatures [degC], angles [rad]."""
    if series in TEMPERATURES:
        return result["thermal.T"].to_numpy()[:, TEMPERATURES.index(series)] - 273.15
    return -result["rod.tip.euler"].to_numpy()[:, ANGLES.index(series)]


def deviations(result: xr.Dataset, scene: str) -> tuple[float, float]:
    """Root mean squares over all sharp points of a scene: temperatures [K], angles [rad]."""
    time = result["time"].to_numpy()
    points = {series: reading.sharp() for series, reading in readings(scene).items()}
    off = {series: np.interp(p.time, time, course(result, series)) - p.value for series, p in points.items()}
    temperature, angle = (np.concatenate([off[series] for series in group]) for group in (TEMPERATURES, ANGLES))
    return float(np.sqrt(np.mean(temperature**2))), float(np.sqrt(np.mean(angle**2)))


def _rows(name: str) -> list[dict[str, str]]:
    lines = (Path(__file__).parent / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
