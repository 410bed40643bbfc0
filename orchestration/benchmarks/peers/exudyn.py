"""Exudyn: geometrically exact beams, generalised-alpha, modified Newton method, its build without range checks.

Planar with linear or quadratic elements; spatial with linear ones.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

sys.exudynFast = True  # type: ignore[attr-defined]  # the import reads it
import exudyn as exu  # noqa: E402
import exudyn.itemInterface  # noqa: E402
from exudyn.beams import GenerateBeamElementsAlongLine  # noqa: E402

from .release import Code, ReleaseProblem, Setting  # noqa: E402

__all__ = ["CODE"]

_NAMES = ("dim", "degree", "elements", "h", "rho", "newton")  # h: step [s]; rho: spectral radius at infinity
_PLAIN = (2, 1, 10, 2e-3, 0.9, 1e-8)
# the best of 400 combinations by error at 0.1 s or by the largest error, fast to fine
_UNDAMPED = ((2, 2, 1, 1e-2, 0.9, 1e-2), (2, 2, 2, 5e-3, 1.0, 1e-2), (2, 2, 3, 2e-3, 0.9, 1e-2))
_FINE = ((2, 2, 3, 2e-3, 1.0, 1e-4), (2, 2, 4, 1e-3, 0.7, 1e-2), (2, 2, 4, 1e-3, 0.5, 1e-4), (2, 2, 5, 5e-4, 0.5, 1e-4))
_DAMPED = (
    (2, 2, 1, 1e-2, 0.9, 1e-2),
    (2, 1, 6, 5e-3, 1.0, 1e-2),
    (2, 2, 2, 5e-3, 1.0, 1e-4),
    (2, 2, 3, 2.5e-3, 0.9, 1e-4),
)
_DAMPED_FINE = ((2, 2, 3, 2e-3, 0.7, 1e-4), (2, 2, 4, 1e-3, 0.5, 1e-4), (2, 2, 5, 5e-4, 0.5, 1e-4))
_SPATIAL = ((3, 1, 4, 5e-3, 0.9, 1e-2), (3, 1, 8, 5e-3, 0.9, 1e-2), (3, 1, 10, 2e-3, 0.9, 1e-2))


def settings(damped: bool) -> list[Setting]:
    """Settings that are measured."""
    rows = (_PLAIN, *_DAMPED, *_DAMPED_FINE) if damped else (_PLAIN, *_UNDAMPED, *_FINE, *_SPATIAL)
    return [dict(zip(_NAMES, row, strict=True)) for row in rows]


def prepare(release: ReleaseProblem, setting: Setting) -> Callable[[], np.ndarray]:
    """Set up one setting and return its simulation."""
    system, elements = exu.SystemContainer().AddSystem(), int(setting["elements"])
    planar = setting["dim"] == 2
    tip = _planar(system, release, int(setting["degree"]), elements) if planar else _spatial(system, release, elements)
    seen = {"outputVariableType": exu.OutputVariableType.Position, "storeInternal": True, "writeToFile": False}
    sensor = system.AddSensor(exu.itemInterface.SensorNode(nodeNumber=tip, **seen))
    system.Assemble()
    options: Any = exu.SimulationSettings()  # its stubs lack attributes that are there
    options.solutionSettings.writeSolutionToFile = False
    options.solutionSettings.sensorsWritePeriod = 0.01
    time = options.timeIntegration
    time.endTime, time.numberOfSteps = release.times[-1], round(release.times[-1] / setting["h"])
    time.adaptiveStep = time.automaticStepSize = False
    time.newton.useModifiedNewton, time.newton.relativeTolerance = True, setting["newton"]
    time.generalizedAlpha.spectralRadius = setting["rho"]

    def simulate() -> np.ndarray:
        system.SolveDynamic(options)
        rows = np.asarray(system.GetSensorStoredData(sensor), dtype=float)
        return rows[np.searchsorted(rows[:, 0], release.times - 1e-9), 1:3] * (1, -1)

    return simulate


def _planar(system: exu.MainSystem, release: ReleaseProblem, degree: int, elements: int) -> int:
    """Add a planar beam, clamped at 0, along x, gravity along -y; the node of its tip."""
    bending, axial = release.E * release.second_moment, release.E * release.area
    shear = release.shear_factor * release.G * release.area
    beam = exu.itemInterface.ObjectBeamGeometricallyExact2D(
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
    return GenerateBeamElementsAlongLine(system, *line, elements, beam, down, clamp)["nodes"][-1]


def _spatial(system: exu.MainSystem, release: ReleaseProblem, elements: int) -> int:
    """Add a spatial beam, with rotation vectors and Lie group integration; the node of its tip."""
    item, section = exu.itemInterface, exu.BeamSection()
    section.massPerLength = release.rho * release.area
    section.inertia = release.rho * release.second_moment * np.diag([2.0, 1.0, 1.0])
    E, G = np.array([release.E, release.G])[:, None] * (release.area, release.second_moment)
    shear = release.shear_factor * G[0]
    section.stiffnessMatrix = np.diag([E[0], shear, shear, 2 * G[1], E[1], E[1]])
    ends = [[x, 0, 0, 0, 0, 0] for x in np.linspace(0.0, release.length, elements + 1)]
    nodes = [system.AddNode(item.NodeRigidBodyRotVecLG(referenceCoordinates=end)) for end in ends]
    for pair in itertools.pairwise(nodes):
        beam = item.ObjectBeamGeometricallyExact("", list(pair), release.length / elements, section)
        mass = system.AddMarker(item.MarkerBodyMass(bodyNumber=system.AddObject(beam)))
        system.AddLoad(item.LoadMassProportional(markerNumber=mass, loadVector=[0, -release.gravity, 0]))
    wall = system.AddMarker(item.MarkerBodyRigid(bodyNumber=system.AddObject(item.ObjectGround())))
    held = system.AddMarker(item.MarkerNodeRigid(nodeNumber=nodes[0]))
    system.AddObject(item.ObjectJointGeneric(markerNumbers=[wall, held], constrainedAxes=[1] * 6))
    return nodes[-1]


_REMARK = "dim 2: planar; dim 3: spatial, undamped only (the damping matrix of its section has no effect in 1.13.6)"
CODE = Code("Exudyn", _REMARK, settings, prepare)
