"""Values read off Fig. 3 of the paper."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

__all__ = [
    "ANGLES",
    "SCENES",
    "SWITCH",
    "TEMPERATURES",
    "TIP_ERROR",
    "Reading",
    "TipReading",
    "readings",
    "tip_readings",
]

SCENES = ("step", "switch", "sine")
TEMPERATURES = ("T1", "T2", "T3")
ANGLES = ("YZ", "XZ", "XY")
SWITCH = 15.0  # [s] time at which the voltages of scene `switch` jump
TIP_ERROR = 0.5  # [mm] reading error of a position of the tip
_BLURRED_START = 0.6  # [s] the line width of the figure hides what happens before
_BLURRED_SWITCH = 0.3  # [s] likewise on both sides of the switch


@dataclass(frozen=True)
class Reading:
    """Points read off one curve."""

    time: np.ndarray  # (n,) [s]
    value: np.ndarray  # (n,) [degC] or [rad]

    def sharp(self) -> Reading:
        """Remove the points that the line width of the figure blurs."""
        return self._select((self.time > _BLURRED_START) & (np.abs(self.time - SWITCH) > _BLURRED_SWITCH))

    def at(self, time: float, count: int = 6) -> float:
        """Value at a time up to SWITCH, or after it, by a straight line through the nearest points on that side.

        A curve without points there lies on the axis of the figure and is zero.
        """
        side = self._select(self.time < SWITCH if time <= SWITCH else self.time > SWITCH)
        nearest = np.argsort(np.abs(side.time - time))[:count]
        if nearest.size == 0:
            return 0.0
        return float(np.polyfit(side.time[nearest] - time, side.value[nearest], 1)[-1])

    def _select(self, keep: np.ndarray) -> Reading:
        return Reading(self.time[keep], self.value[keep])


@dataclass(frozen=True)
class TipReading:
    """Position of the tip in the top view at one time."""

    time: float  # [s]
    x: float  # [mm]
    y: float  # [mm]


def readings(scene: str) -> dict[str, Reading]:
    """Points of the curves T1, T2, T3, YZ, XZ, XY of a scene by their name."""
    rows = [row for row in _rows("fig3.csv") if row["scene"] == scene]
    return {
        series: Reading(
            np.array([float(row["t_s"]) for row in rows if row["series"] == series]),
            np.array([float(row["value"]) for row in rows if row["series"] == series]),
        )
        for series in (*TEMPERATURES, *ANGLES)
    }


def tip_readings(scene: str) -> list[TipReading]:
    """Positions of the tip of a scene in the order of time."""
    rows = (row for row in _rows("tip.csv") if row["scene"] == scene)
    return [TipReading(float(row["t_s"]), float(row["x_mm"]), float(row["y_mm"])) for row in rows]


def _rows(name: str) -> list[dict[str, str]]:
    lines = (Path(__file__).parent / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
