"""The problem that all codes solve: the bare rod, straight, clamped and at rest, released under transverse gravity for
one second, undamped or with Kelvin-Voigt damping. Reference and its origin: rod_release.csv. SI units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...fmi.archive import Archive

__all__ = ["PROBE", "Code", "Release", "Setting"]

PROBE = 0.1  # s, when errors are compared
Setting = Mapping[str, float]


class Release:
    """archive: rod.fmu, whose start values are the geometry and E, nu. times: (5,); reference: (5, 2), the tip along
    the axis and across at these times."""

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
    """prepare: sets up and returns what is timed: it simulates the second and returns the tip at release.times (5, 2);
    truth: the tip that errors are measured against, nan where none is known."""

    name: str
    remark: str
    settings: Callable[[bool], Sequence[Setting]]  # damped ->
    prepare: Callable[[Release, Setting], Callable[[], np.ndarray]]
    truth: Callable[[Release], np.ndarray] = lambda release: release.reference
