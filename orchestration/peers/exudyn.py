"""Exudyn: planar geometrically exact beam of linear or quadratic elements, generalised-alpha, modified Newton method,
its build without range checks."""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

sys.exudynFast = True  # the import reads it
import exudyn as exu  # noqa: E402
import exudyn.itemInterface  # noqa: E402
from exudyn.beams import GenerateBeamElementsAlongLine  # noqa: E402

from .release import Code, Release, Setting  # noqa: E402

__all__ = ["CODE"]

# First a plain choice, then the best of 400 combinations, by error at 0.1 s or by the largest error, fast to fine.
_NAMES = ("degree", "elements", "h", "rho", "newton")  # h: step [s]; rho: spectral radius at infinity
_PLAIN = (1, 10, 2e-3, 0.9, 1e-8)
_UNDAMPED = ((2, 1, 1e-2, 0.9, 1e-2), (2, 2, 5e-3, 1.0, 1e-2), (2, 3, 2e-3, 0.9, 1e-2), (2, 3, 2e-3, 1.0, 1e-4))
_UNDAMPED_FINE = ((2, 4, 1e-3, 0.7, 1e-2), (2, 4, 1e-3, 1.0, 1e-2), (2, 4, 1e-3, 0.5, 1e-4), (2, 5, 5e-4, 0.5, 1e-4))
_DAMPED = ((2, 1, 1e-2, 0.9, 1e-2), (1, 6, 5e-3, 1.0, 1e-2), (2, 2, 5e-3, 1.0, 1e-4), (2, 3, 2.5e-3, 0.9, 1e-4))
_DAMPED_FINE = ((2, 3, 2e-3, 0.7, 1e-4), (2, 4, 1e-3, 0.5, 1e-4), (2, 5, 5e-4, 0.5, 1e-4))


def settings(damped: bool) -> list[Setting]:
    rows = (_PLAIN, *_DAMPED, *_DAMPED_FINE) if damped else (_PLAIN, *_UNDAMPED, *_UNDAMPED_FINE)
    return [dict(zip(_NAMES, row, strict=True)) for row in rows]


def prepare(release: Release, setting: Setting) -> Callable[[], np.ndarray]:
    system = exu.SystemContainer().AddSystem()
    sensor = _beam(system, release, int(setting["degree"]), int(setting["elements"]))
    options = exu.SimulationSettings()
    options.solutionSettings.writeSolutionToFile = False
    options.solutionSettings.sensorsWritePeriod = 0.01
    time = options.timeIntegration
    time.endTime, time.numberOfSteps = release.times[-1], round(release.times[-1] / setting["h"])
    time.adaptiveStep = time.automaticStepSize = False
    time.newton.useModifiedNewton, time.newton.relativeTolerance = True, setting["newton"]
    time.generalizedAlpha.spectralRadius = setting["rho"]

    def simulate() -> np.ndarray:
        system.SolveDynamic(options)
        rows = system.GetSensorStoredData(sensor)
        return rows[np.searchsorted(rows[:, 0], release.times - 1e-9), 1:3] * (1, -1)

    return simulate


def _beam(system: exu.MainSystem, release: Release, degree: int, elements: int) -> int:
    """Clamped at 0, along x, gravity along -y; the sensor at its tip."""
    bending, axial = release.E * release.second_moment, release.E * release.area
    shear = release.shear_factor * release.G * release.area
    template = exu.itemInterface.ObjectBeamGeometricallyExact2D(
        nodeNumbers=[0] * (degree + 1),
        massPerLength=release.rho * release.area,
        crossSectionInertia=release.rho * release.second_moment,
        bendingStiffness=bending,
        axialStiffness=axial,
        shearStiffness=shear,
        bendingDamping=release.retardation * bending,
        axialDamping=release.retardation * axial,
        shearDamping=release.retardation * shear,
    )
    line, down, clamp = ([0, 0, 0], [release.length, 0, 0]), [0, -release.gravity, 0], [1, 1, 1]
    tip = GenerateBeamElementsAlongLine(system, *line, elements, template, down, clamp)["nodes"][-1]
    position = exu.OutputVariableType.Position
    sensor = exu.itemInterface.SensorNode(
        nodeNumber=tip, outputVariableType=position, storeInternal=True, writeToFile=False
    )
    number = system.AddSensor(sensor)
    system.Assemble()
    return number


CODE = Code("Exudyn", "planar: 3 coordinates a node", settings, prepare)
