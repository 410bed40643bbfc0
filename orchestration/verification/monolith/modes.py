"""Natural frequencies and damping ratios of a scene's small motions, by linearisation of the monolith.

With x' = A x + B u, y = C x + D u of all parts and the wiring u = L y, the system's matrix is A + B (I - L D)^-1 L C.
An eigenvalue w of it with an imaginary part is a mode of frequency |w|/(2 pi) and damping ratio -Re w/|w|.

A quasi-static rod is linearised as a dynamic one about the equilibrium that it has reached: its strains are handed
over. The distance of every member to its equilibrium is estimated by one Newton step -A^-1 x', since the modes of a
state that moves hold only for motions that are short against that movement.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from scipy.linalg import block_diag

from ...errors import SceneError, SubsystemError
from ...scene import Member, Scene
from ...scene.loop_closure import closed_inside
from .integration import trajectory
from .model_exchange import ModelExchangePart
from .part import QuasiStaticPart
from .system import System, assembled

__all__ = ["AT_REST", "Mode", "Modes", "natural_modes"]

_ROUNDING = 1e-9  # share of the largest eigenvalue below which an imaginary part is rounding
_STANDS = 1e-7  # the same of a growth: a neutral motion is a double eigenvalue 0, known to the root of rounding only
AT_REST = 1e-3  # distance to equilibrium in nominals of the states below which a member is taken to rest


@dataclass(frozen=True)
class Mode:
    """A natural mode: frequency [Hz] and damping ratio; a negative one grows."""

    frequency: float
    damping: float


@dataclass(frozen=True)
class Modes:
    """The natural modes of a system at one state.

    Parameters
    ----------
    modes : tuple of Mode
        In ascending order of frequency.
    states : int
        Number of states that act.
    growing : float
        Largest real part of all eigenvalues [1/s], 0 where it is rounding; positive: the state is unstable.
    offsets : mapping of str to float
        Estimated distance of each member's states to their equilibrium for the present inputs, in nominals; inf where
        there is none nearby.
    """

    modes: tuple[Mode, ...]
    states: int
    growing: float
    offsets: Mapping[str, float] = field(default_factory=dict)

    @property
    def remarks(self) -> list[str]:
        """One sentence for each member that is not at equilibrium, and for an unstable state."""
        sentences = [
            f"{name} is not at equilibrium (about {offset:.2g} nominals of its states away): its modes hold only for "
            "motions that are short against its drift; choose another --time, or a start at equilibrium"
            for name, offset in self.offsets.items()
            if not offset <= AT_REST
        ]
        if self.growing > 0.0:
            sentences.append(f"the state is unstable: a deviation grows by the factor e in {1.0 / self.growing:.3g} s")
        return sentences


def natural_modes(scene: Scene, time: float = 0.0, tolerance: float = 1e-9) -> Modes:
    """Natural modes of the scene's system at a time.

    Parameters
    ----------
    scene : Scene
        The scene; its FMUs are needed as model exchange. Quasi-static rods are linearised with inertia about the
        equilibrium that they have reached.
    time : float
        When to linearise [s].
    tolerance : float
        Relative, of the integration up to that time.

    Returns
    -------
    Modes

    Raises
    ------
    SceneError, SubsystemError
        Where the system cannot be solved (solve_monolith), has no states or no finite derivatives.
    """
    scene = closed_inside(scene)
    with contextlib.ExitStack() as stack:
        system = stack.enter_context(assembled(scene))
        begin = scene.start_time
        grid = np.array([begin, time if time > begin else begin + 1.0])
        # Brings the system to the time and leaves it there.
        at = next((point for point in trajectory(scene, system, tolerance, grid) if point.time >= time), None)
        if at is None:
            raise SceneError(f"{scene.name}: the run ends before t = {time:g} s, as an FMU wishes; choose less")
        for member in scene.members:
            part = system.parts[member.name]
            if isinstance(part, QuasiStaticPart):
                model = stack.enter_context(contextlib.closing(_with_inertia(member, part)))
                model.initialise(at.time, system.inputs(member.name))
                states = model.begin()
                reached = part.read(model.states_in_use())
                model.set_state(at.time, np.array([reached.get(name, 0.0) for name in model.states_in_use()]))
                model.set_inputs(system.inputs(member.name))
                if states.size and not reached:
                    raise SubsystemError(f"{member.name}: offers none of its states as variables to hand over")
                system.parts[member.name] = model
        models = cast("dict[str, ModelExchangePart]", system.parts)  # quasi-static parts have been replaced
        blocks = {name: model.linearised() for name, model in models.items()}
        offsets = {name: _offset(models[name], A) for name, (A, *_) in blocks.items()}
        return _spectrum(scene.name, _matrix(system, list(blocks.values())), offsets)


def _with_inertia(member: Member, part: QuasiStaticPart) -> ModelExchangePart:
    moving = member.with_values({"dynamic": True, "start_at_equilibrium": False})
    names = [[port.name for port in ports] for ports in (part.inputs, part.outputs)]
    return ModelExchangePart(moving, *names)


def _offset(model: ModelExchangePart, A: np.ndarray) -> float:
    """Largest component of the Newton step to the equilibrium, in nominals of the states."""
    rates = model.rates()
    acting = np.abs(A).max(axis=0, initial=0.0) > 0.0  # what acts on nothing is a record and has no equilibrium
    if not acting.any() or not rates[acting].any():
        return 0.0
    block, right = A[np.ix_(acting, acting)], rates[acting]
    if not (np.isfinite(block).all() and np.isfinite(right).all()):
        return math.inf
    step, *_ = np.linalg.lstsq(block, -right, rcond=None)
    if np.linalg.norm(block @ step + right) > 1e-6 * np.linalg.norm(right):
        return math.inf  # a drift that no state balances
    return float(np.abs(step / model.nominals[acting]).max())


def _matrix(system: System, blocks: Iterable[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]) -> np.ndarray:
    A, B, C, D = (block_diag(*matrices) for matrices in zip(*blocks, strict=True))
    first_input, first_output, inputs, outputs = {}, {}, 0, 0
    for name, part in system.parts.items():
        first_input[name], first_output[name] = inputs, outputs
        inputs, outputs = inputs + len(part.inputs), outputs + len(part.outputs)
    L = np.zeros((inputs, outputs))
    for wire in system.wires:
        L[first_input[wire.target] + wire.input, first_output[wire.source] + wire.output] += wire.connection.factor
    A, B, C, D = (
        matrix.reshape(shape)  # block_diag drops the shape of empty blocks
        for matrix, shape in (
            (A, A.shape),
            (B, (A.shape[0], inputs)),
            (C, (outputs, A.shape[0])),
            (D, (outputs, inputs)),
        )
    )
    try:
        return A + B @ np.linalg.solve(np.eye(inputs) - L @ D, L @ C)
    except np.linalg.LinAlgError:
        raise SceneError(
            "modes: outputs depend on each other at once without a solution; remove a connection"
        ) from None


def _spectrum(scene: str, A: np.ndarray, offsets: Mapping[str, float]) -> Modes:
    if not np.isfinite(A).all():
        raise SubsystemError(f"{scene}: derivatives of the FMUs are not finite at this state; choose another time")
    acting = np.abs(A).max(axis=0, initial=0.0) > 0.0  # what acts on nothing is a record, such as the heat of damping
    if not acting.any():
        raise SceneError(f"{scene}: no state of the system acts on another one, so there are no modes")
    values = np.linalg.eigvals(A[np.ix_(acting, acting)])
    swinging = values[values.imag > _ROUNDING * np.abs(values).max()]
    modes = sorted(
        (Mode(float(abs(w)) / (2 * math.pi), float(-w.real / abs(w))) for w in swinging),
        key=lambda mode: mode.frequency,
    )
    growing = float(values.real.max())
    growing = 0.0 if abs(growing) <= _STANDS * np.abs(values).max() else growing
    return Modes(tuple(modes), int(acting.sum()), growing, dict(offsets))
