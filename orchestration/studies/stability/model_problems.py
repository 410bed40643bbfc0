"""Analytic systems with known stability limits of their coupling, and functions that couple them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...cosim.graph import assemble
from ...cosim.linear_subsystem import Linear
from ...cosim.master import Master, StepLog
from ...cosim.node import MacroStep
from ...cosim.settings import Coupling
from ...cosim.signals import Signal
from ...cosim.step_control import Control, Fixed
from ...cosim.step_error import StepError, give_up
from ...cosim.subsystem import Port, Subsystem
from ...cosim.time_loop import drive
from ...cosim.topology import Connection
from .verdict import spectral_growth

__all__ = [
    "Implicit",
    "actuated",
    "connected",
    "couple",
    "dahlquist",
    "linear",
    "state_record",
    "step_radius",
    "two_masses",
    "wires",
]

CoupledSystem = tuple[list[Linear], list[Connection]]


class Implicit(Linear):
    """Linear subsystem that takes one backward Euler step per macro step: x+ = (1 - h A)^-1 (x + h B u(t+h))."""

    def step(self, time: float, length: float) -> None:
        """Advance from time [s] by length [s]."""
        before = self.state
        super().step(time, length)  # moves the inputs to the end of the step
        left = np.eye(len(before)) - length * self.A
        self.state = np.linalg.solve(left, before + length * self.B @ self._u[0])


def linear(
    name: str, a: list, b: list, c: list, d: list, start: list, inputs: str, outputs: str, kind: type[Linear] = Linear
) -> Linear:
    """Linear subsystem from matrices as nested lists, and from names of inputs and outputs separated by blanks."""
    n, u, y = len(start), inputs.split(), outputs.split()
    A, B, C, D = (
        np.reshape(np.array(m, dtype=float), s)
        for m, s in ((a, (n, n)), (b, (n, len(u))), (c, (len(y), n)), (d, (len(y), len(u))))
    )
    return kind(name, A, B, C, D, np.array(start, dtype=float), tuple(map(Port, u)), tuple(map(Port, y)))


def wires(*texts: str) -> list[Connection]:
    """Connections from texts 'a.x -> b.u'."""
    ends = [[end.strip().partition(".") for end in text.split("->")] for text in texts]
    return [Connection((source[0], source[2]), (target[0], target[2])) for source, target in ends]


def dahlquist(gain: float = 4.0) -> CoupledSystem:
    """Split Dahlquist problem: x' = -x + u, u = -gain x, x(0) = 1, so that x = exp(-(1 + gain) t)."""
    plant = linear("plant", [-1], [1], [1], [0], [1], "u", "x")
    law = linear("law", [], [], [], [-gain], [], "x", "u")
    return [plant, law], wires("plant.x -> law.x", "law.u -> plant.u")


def actuated(damping: float = 0.0, gain: float = 4.0, kind: type[Linear] = Linear) -> CoupledSystem:
    """Actuator on an oscillator: x'' = -x - damping x' + F, F = -gain x."""
    mass = linear("mass", [[0, 1], [-1, -damping]], [0, 1], [1, 0], [0], [1, 0], "F", "x", kind)
    actuator = linear("actuator", [], [], [], [-gain], [], "x", "F")
    return [mass, actuator], wires("mass.x -> actuator.x", "actuator.F -> mass.F")


def two_masses(kind: str, c: float = 1.0, d: float = 1.0, cc: float = 1.0, dc: float = 1.0) -> CoupledSystem:
    """Two unit masses, each on a spring c and damper d, coupled by a spring cc and damper dc (Busch, Schweizer).

    kind force: force/displacement coupling, the coupling spring belongs to the second mass; displacement:
    displacement/displacement coupling, both have it.
    """
    own, coupled = [[0, 1], [-c, -d]], [[0, 1], [-c - cc, -d - dc]]
    other, states, none = [[0, 0], [cc, dc]], [[1, 0], [0, 1]], [[0, 0], [0, 0]]
    second = linear("b", coupled, other, states, none, [0.5, 0], "x v", "y w")
    if kind == "displacement":
        first = linear("a", coupled, other, states, none, [1, 0], "x v", "y w")
        return [first, second], wires("a.y -> b.x", "a.w -> b.v", "b.y -> a.x", "b.w -> a.v")
    first = linear("a", own, [0, 1], states, [0, 0], [1, 0], "F", "y w")
    second = linear("b", coupled, other, [cc, dc], [-cc, -dc], [0.5, 0], "x v", "F")
    return [first, second], wires("a.y -> b.x", "a.w -> b.v", "b.F -> a.F")


def couple(
    systems: Sequence[Subsystem],
    connections: Sequence[Connection],
    stop: float,
    step: float = 0.1,
    method: str | None = "iqn",
    waveform: str = "linear",
    through: str = "hermite",
    jacobi: bool = False,
    signals: dict[str, dict[str, Signal]] | None = None,
    control: Control | None = None,
    breaks: Sequence[float] = (),
    observe: Callable[[], object] = lambda: None,
    **settings: Any,
) -> tuple[Master, list[StepLog]]:
    """Couple subsystems until `stop` [s]; the master there and its log.

    through: extrapolation method of inputs known at both ends of a step; settings: of the master. Raises CouplingError,
    SubsystemError.
    """
    master = connected(systems, connections, method, waveform, through, jacobi, signals, observe, **settings)
    return master, list(drive(master, control or Fixed(step), 0.0, stop, breaks))


def connected(
    systems: Sequence[Subsystem],
    connections: Sequence[Connection],
    method: str | None,
    waveform: str = "linear",
    through: str = "hermite",
    jacobi: bool = False,
    signals: dict[str, dict[str, Signal]] | None = None,
    observe: Callable[[], object] = lambda: None,
    **settings: Any,
) -> Master:
    """The initialised master of coupled subsystems."""
    coupling = Coupling(
        schedule="jacobi" if jacobi else "gauss_seidel",
        method=method or "none",
        exchange=through,
        waveform=waveform,
        **{"reach": 1e9, "omega": 0.5, **settings},
    )
    master = Master(assemble(systems, connections, signals or {}, coupling), coupling, observe)
    master.initialise(0.0)
    return master


def state_record(
    systems: list[Linear],
    connections: list[Connection],
    step: float,
    count: int,
    method: str | None = "iqn",
    **how: Any,
) -> tuple[list[np.ndarray], list[StepLog]]:
    """States (n,) after each of `count` macro steps of exactly that length [s], and the log.

    The start excites all states. Raises CouplingError.
    """
    for system in systems:
        system.start = system.start + 0.1 * np.arange(1.0, system.start.size + 1.0)
    master = connected(
        systems,
        connections,
        method,
        observe=lambda: np.concatenate([system.state for system in systems]),
        **how,
    )
    logs: list[StepLog] = []
    for number in range(count):
        try:
            logs.append(master.advance(MacroStep(number * step, step, (number + 1) * step)))
        except StepError as failure:
            raise give_up(number * step, step, failure, master.settings.method) from failure
    return [log.record for log in logs], logs


def step_radius(systems: list[Linear], connections: list[Connection], step: float, **how: Any) -> float:
    """Spectral radius of one macro step, identified from a run (verdict.spectral_growth)."""
    return spectral_growth(state_record(systems, connections, step, 80, **how)[0])
