"""Natural frequencies and damping ratios of a scene's whole system, linearised by its FMUs' directional derivatives.

With x' = A x + B u, y = C x + D u of all parts and the wiring u = L y, the system's matrix is A + B (I - L D)^-1 L C.
An eigenvalue w of it with an imaginary part is a mode of frequency |w|/(2 pi) and damping ratio -Re w/|w|."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from scipy.linalg import block_diag

from ...scene import Member, Scene
from ...scene.loop_closure import closed_inside
from .part import Model, Part
from .solve import course
from .system import System, assembled

__all__ = ["Mode", "Modes", "modes"]

_ROUNDING = 1e-9  # share of the largest eigenvalue below which an imaginary part is none


@dataclass(frozen=True)
class Mode:
    frequency: float  # [Hz]
    damping: float  # ratio; negative: the motion grows


@dataclass(frozen=True)
class Modes:
    modes: tuple[Mode, ...]  # ascending in frequency
    states: int
    growing: float  # largest real part of all eigenvalues [1/s]; positive: unstable


def modes(scene: Scene, time: float = 0.0, tolerance: float = 1e-9) -> Modes:
    """At that time [s] of the scene. Where a member is quasi-static: its small motion about the equilibrium there.
    Raises SceneError, SubsystemError."""
    scene = closed_inside(scene)
    with contextlib.ExitStack() as stack:
        system = stack.enter_context(assembled(scene))
        # Brings the system to the time and leaves it there.
        next(point for point in course(scene, system, tolerance, np.array([0.0, time or 1.0])) if point.time >= time)
        for member in scene.members:
            if member.value("dynamic") is False:
                model = stack.enter_context(contextlib.closing(_moving(member, system.parts[member.name])))
                model.initialise(time, system.inputs(member.name))
                model.begin()
                system.parts[member.name] = model
        return _spectrum(_matrix(system))


def _moving(member: Member, part: Part) -> Model:
    parameters = {**member.parameters, "dynamic": True, "start_at_equilibrium": True}
    names = [[port.name for port in ports] for ports in (part.inputs, part.outputs)]
    return Model(replace(member, parameters=parameters), *names)


def _matrix(system: System) -> np.ndarray:
    models = cast("Iterable[Model]", system.parts.values())  # equilibria have given way to models
    blocks = [model.linearised() for model in models]
    A, B, C, D = (block_diag(*(block[k] for block in blocks)) for k in range(4))
    first_input, first_output, inputs, outputs = {}, {}, 0, 0
    for name, part in system.parts.items():
        first_input[name], first_output[name] = inputs, outputs
        inputs, outputs = inputs + len(part.inputs), outputs + len(part.outputs)
    L = np.zeros((inputs, outputs))
    for wire in system.wires:
        L[first_input[wire.target] + wire.input, first_output[wire.source] + wire.output] = wire.connection.factor
    return A + B @ np.linalg.solve(np.eye(inputs) - L @ D, L @ C)


def _spectrum(A: np.ndarray) -> Modes:
    acting = np.abs(A).max(axis=0) > 0.0  # what acts on nothing is a record, such as the heat of damping
    values = np.linalg.eigvals(A[np.ix_(acting, acting)])
    swinging = values[values.imag > _ROUNDING * np.abs(values).max()]
    found = sorted(
        (Mode(float(abs(w)) / (2 * math.pi), float(-w.real / abs(w))) for w in swinging),
        key=lambda mode: mode.frequency,
    )
    return Modes(tuple(found), int(acting.sum()), float(values.real.max()))
