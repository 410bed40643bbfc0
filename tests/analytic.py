"""Analytic systems and a short way to couple them, for the tests of the master."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from orchestration import exchange, iteration
from orchestration.drive import drive
from orchestration.linear import Linear
from orchestration.master import Master, Settings, StepLog
from orchestration.network import assemble
from orchestration.signals import Signal
from orchestration.stepping import Control, Fixed
from orchestration.subsystem import Port, Subsystem
from orchestration.wiring import Connection


def linear(name: str, a: list, b: list, c: list, d: list, start: list, inputs: str, outputs: str) -> Linear:
    """Matrices as nested lists; inputs and outputs as names with blanks between."""
    n, u, y = len(start), inputs.split(), outputs.split()
    shaped = (
        np.reshape(np.array(m, dtype=float), s)
        for m, s in ((a, (n, n)), (b, (n, len(u))), (c, (len(y), n)), (d, (len(y), len(u))))
    )
    return Linear(name, *shaped, np.array(start, dtype=float), tuple(map(Port, u)), tuple(map(Port, y)))


def wires(*texts: str) -> list[Connection]:
    """'a.x -> b.u' each."""
    pairs = [[tuple(end.strip().split(".")) for end in text.split("->")] for text in texts]
    return [Connection(source, target) for source, target in pairs]


def couple(
    systems: Sequence[Subsystem],
    connections: Sequence[Connection],
    stop: float,
    step: float = 0.1,
    method: str | iteration.Method | None = "iqn",
    waveform: str = "linear",
    through: str = "hermite",
    jacobi: bool = False,
    signals: dict[str, dict[str, Signal]] | None = None,
    control: Control | None = None,
    breaks: Sequence[float] = (),
    observe: Callable[[], object] = lambda: None,
    **settings: float,
) -> tuple[Master, list[StepLog]]:
    """The master at `stop` and its log."""
    made = iteration.METHODS[method]() if isinstance(method, str) else method
    kinds = exchange.METHODS[through], exchange.METHODS[waveform]
    circuits = assemble(systems, connections, signals or {}, *kinds, jacobi)
    master = Master(circuits, Settings(*kinds, made, **{"reach": 1e9, **settings}), observe)
    master.initialise(0.0)
    return master, list(drive(master, control or Fixed(step), 0.0, stop, breaks))


def dahlquist() -> tuple[list[Linear], list[Connection]]:
    """x' = -x + u, u = -4 x, x(0) = 1, so x = exp(-5 t), split in two."""
    plant = linear("plant", [-1], [1], [1], [0], [1], "u", "x")
    law = linear("law", [], [], [], [-4], [], "x", "u")
    return [plant, law], wires("plant.x -> law.x", "law.u -> plant.u")


def step_radius(systems: list[Linear], connections: list[Connection], step: float, **how: object) -> float:
    """Spectral radius of one macro step as a linear map of states and history, seen from the course of a run: delay
    vectors of the states follow the map, whose eigenvalues a least-squares fit of it has."""
    record, run = [], 80
    for system in systems:
        system.state = system.start + 0.1 * np.arange(1.0, system.start.size + 1.0)
        system.start = system.state
    couple(
        systems,
        connections,
        run * step,
        step,
        observe=lambda: record.append(np.concatenate([s.state for s in systems])),
        **how,
    )
    course = np.array(record[3:]).T  # the first steps have less history
    delayed = np.vstack([course[:, k : course.shape[1] - 3 + k] for k in range(3)])
    weight = 1.0 / np.linalg.norm(delayed[:, :-1], axis=0)
    u, s, v = np.linalg.svd(delayed[:, :-1] * weight, full_matrices=False)
    rank = int((s > 1e-9 * s[0]).sum())
    projected = u[:, :rank].T @ (delayed[:, 1:] * weight) @ v[:rank].T / s[:rank]
    return float(np.abs(np.linalg.eigvals(projected)).max())
