"""The release problem that all codes solve, in SI units.

The bare rod, straight, clamped and at rest, is released under transverse gravity for one second, undamped or with
Kelvin-Voigt damping. Reference and its origin: rod_release.csv.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...fmi.archive import Archive

__all__ = ["PROBE", "Code", "ReleaseProblem", "Setting"]

PROBE = 0.1  # time at which errors are compared [s]
Setting = Mapping[str, float]


class ReleaseProblem:
    """Parameters and reference of the release.

    archive: rod.fmu, whose start values are the geometry and E, nu; times: (5,) [s]; reference: (5, 2) [m], the tip
    along the axis and across it at these times.
    """

    gravity, rho, shear_factor = 9.81, 1070.0, 27 / 28  # the shear factor that PyElastica has built in

    def __init__(self, archive: Archive, damped: bool) -> None:
        self.archive, self.damped = archive, damped
        self.retardation = 5e-3 if damped else 0.0
        body = {name: float(archive.variables[f"body.{name}"].start or 0) for name in ("length", "radius", "E", "nu")}
        self.length, self.radius, self.E = body["length"], body["radius"], body["E"]
        self.G = self.E / (2 * (1 + body["nu"]))
        self.area, self.second_moment = math.pi * self.radius**2, math.pi * self.radius**4 / 4
        rows = np.genfromtxt(Path(__file__).with_name("rod_release.csv"), delimiter=",", skip_header=2, names=True)
        self.times = rows["t_s"]
        tip = [rows[f"{what}_{'damped' if damped else 'undamped'}"] for what in ("axis", "defl")]
        self.reference = 1e-3 * np.column_stack(tip)


@dataclass(frozen=True)
class Code:
    """A code that solves the release.

    Parameters
    ----------
    name, remark : str
        For the table.
    settings : callable
        Whether damped -> settings to be measured.
    prepare : callable
        Sets up one setting and returns the function that is timed: it simulates one second and returns the tip at
        release.times (5, 2) [m].
    reference : callable
        The tip (5, 2) that errors are measured against, nan where none is known.
    """

    name: str
    remark: str
    settings: Callable[[bool], Sequence[Setting]]
    prepare: Callable[[ReleaseProblem, Setting], Callable[[], np.ndarray]]
    reference: Callable[[ReleaseProblem], np.ndarray] = lambda release: release.reference
