"""Linearisation of a scene around a state that it reaches.

Each FMU gives its A, B, C, D by directional derivatives, exact for the rates of the two FMUs of this project. The
connections u = K y + E w close them, with the inputs w that nothing feeds:

    y = (1 - D K)^-1 (C x + D E w),    dx/dt = A x + B (K y + E w).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from ..api import Overrides, Source
from ..errors import SceneError, SubsystemError
from ..fmi.derivatives import continuous_states, jacobian, real_values
from ..fmi.instance import Instance
from ..fmi.variables import Variable
from ..scene import Member, Scene
from ..scene.manipulator import THERMAL
from ..stepping import Simulation
from .model import LinearModel, Quantity

__all__ = ["linearise", "linearise_now"]


def linearise(scene: Source, time: float = 0.0, overrides: Overrides = ()) -> LinearModel:
    """Run a scene to a time and linearise it there.

    Parameters
    ----------
    scene, overrides
        As read() takes them.
    time : float
        Of the operating point [s].

    Returns
    -------
    LinearModel
        From all inputs that nothing feeds to all outputs, without states that stay constant whatever the inputs.

    Raises
    ------
    SceneError
        The scene cannot be run as written, the time is not in it, or its heat has no continuous states.
    SubsystemError
        An FMU offers no derivatives there.
    CouplingError
        The scene does not get to the time.
    """
    with Simulation(scene, overrides) as simulation:
        start = simulation.scene.start_time
        if not start <= time <= simulation.scene.stop_time:
            raise SceneError(
                f"time = {time:g} s: the scene runs from {start:g} s to {simulation.scene.stop_time:g} s; set stop_time"
            )
        if time > start:
            simulation.step(time)
        return linearise_now(simulation)


class _Block(NamedTuple):
    """Linear model of one member; inputs and outputs are its continuous Reals."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: list[Variable]
    inputs: list[Variable]
    outputs: list[Variable]
    x: np.ndarray
    u: np.ndarray
    y: np.ndarray
    dx: np.ndarray


def linearise_now(simulation: Simulation) -> LinearModel:
    """Linearise a simulation where it stands, as linearise() does."""
    scene = simulation.scene
    _require_modes(scene)
    names = [m.name for m in scene.members]
    blocks = [_block(member, simulation.instance(member.name)) for member in scene.members]
    inputs = [(name, v) for name, block in zip(names, blocks, strict=True) for v in block.inputs]
    outputs = [(name, v) for name, block in zip(names, blocks, strict=True) for v in block.outputs]
    states = [(name, v) for name, block in zip(names, blocks, strict=True) for v in block.states]
    K, free = _wiring(scene, inputs, outputs)
    E = np.eye(len(inputs))[:, free]
    A, B, C, D = (block_diag(*(getattr(block, key) for block in blocks)) for key in "ABCD")
    loop = np.eye(len(outputs)) - D @ K
    if outputs and np.linalg.cond(loop) > 1.0 / np.finfo(float).eps:
        raise SubsystemError("the algebraic loop of the connections is singular here; choose another time")
    C, D = np.linalg.solve(loop, C), np.linalg.solve(loop, D @ E)
    A, B = A + B @ K @ C, B @ (E + K @ D)
    x, u, y, dx = (np.concatenate([getattr(block, key) for block in blocks]) for key in ("x", "u", "y", "dx"))
    kept = _moving(A, B)
    return LinearModel(
        A=A[np.ix_(kept, kept)],
        B=B[kept],
        C=C[:, kept],
        D=D,
        states=tuple(_quantity(*states[k]) for k in kept),
        inputs=tuple(_quantity(*inputs[k]) for k in free),
        outputs=tuple(_quantity(*pair) for pair in outputs),
        x_0=x[kept],
        u_0=u[free],
        y_0=y,
        drift=dx[kept],
        time=simulation.time,
        scene=scene.name,
        notes=tuple(
            f"{name} declares no continuous states: its outputs follow its inputs at once"
            for name, block in zip(names, blocks, strict=True)
            if not block.states
        ),
    )


def _require_modes(scene: Scene) -> None:
    """Raise SceneError where the heat of a cross-section is not in the continuous states that its FMU declares."""
    for member in scene.models(THERMAL):
        if "level" in member.archive.variables and member.choice("level") == "full" and not member.frozen:
            raise SceneError(
                f"{member.name}.level = full: the temperatures of the mesh are not continuous states, so that the "
                f"linear model would have no heat; set {member.name}.level = reduced (with convection = constant), or "
                "lumped"
            )


def _block(member: Member, instance: Instance) -> _Block:
    variables = member.archive.variables.values()
    inputs = [v for v in variables if v.causality == "input" and not v.discrete]
    outputs = [v for v in variables if v.causality == "output" and not v.discrete]
    pairs = continuous_states(member.archive)
    states, rates = [s for s, _ in pairs], [r for _, r in pairs]
    n, m = len(states), len(inputs)
    if member.frozen:
        matrix = np.zeros((n + len(outputs), n + m))
    else:
        matrix = jacobian(instance, [*rates, *outputs], [*states, *inputs])
    return _Block(
        matrix[:n, :n],
        matrix[:n, n:],
        matrix[n:, :n],
        matrix[n:, n:],
        states,
        inputs,
        outputs,
        real_values(instance, states),
        real_values(instance, inputs),
        real_values(instance, outputs),
        real_values(instance, rates),
    )


def _wiring(
    scene: Scene, inputs: list[tuple[str, Variable]], outputs: list[tuple[str, Variable]]
) -> tuple[np.ndarray, list[int]]:
    """Return the matrix K (m, p) of the connections and the indices of the inputs that nothing feeds."""
    row = {(name, v.name): k for k, (name, v) in enumerate(inputs)}
    column = {(name, v.name): k for k, (name, v) in enumerate(outputs)}
    K, fed = np.zeros((len(inputs), len(outputs))), set()
    for connection in scene.connections:
        if connection.target in row:
            fed.add(row[connection.target])
            if connection.source in column:
                K[row[connection.target], column[connection.source]] += connection.factor
    return K, [k for k in range(len(inputs)) if k not in fed]


def _moving(A: np.ndarray, B: np.ndarray) -> list[int]:
    """Return the indices of the states that can change: those that the chosen level of a model lacks cannot."""
    kept = np.arange(len(A))
    while True:
        moves = np.any(A[np.ix_(kept, kept)] != 0.0, axis=1) | np.any(B[kept] != 0.0, axis=1)
        if moves.all():
            return list(kept)
        kept = kept[moves]


def _quantity(member: str, variable: Variable) -> Quantity:
    return Quantity(f"{member}.{variable.name}", variable.unit, variable.nominal)
