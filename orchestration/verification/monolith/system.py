"""The members of a scene as one system x' = f(t, x).

Outputs feed inputs in an order in which each is known before it acts (an algebraic loop has none and is refused). A
TCA loop that the scene leaves to the master, delta -> delta_guess, is closed inside the rod instead."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import NamedTuple

import networkx as nx
import numpy as np

from ...cosim.signals import Signal
from ...cosim.topology import Connection
from ...errors import SceneError
from ...scene import Member, Scene
from ...simulation import recorded_variables
from .part import Equilibrium, Model, Part

__all__ = ["System", "Wire", "assembled"]

_INSTANT = 1e-9  # [s]

Piece = tuple[float, float]  # between two events [s]


class Wire(NamedTuple):
    """A connection by columns: an output of the part `source` feeds an input of the part `target`."""

    source: str
    output: int
    target: str
    input: int
    connection: Connection


class System:
    """parts in the scene's order. Use assembled(); values go along wires as in the scene."""

    def __init__(self, scene: Scene, parts: dict[str, Part]) -> None:
        self.parts = parts
        self._inputs = {name: np.array([port.start for port in part.inputs]) for name, part in parts.items()}
        column = {name: {p.name: k for k, p in enumerate(part.inputs)} for name, part in parts.items()}
        place = {name: {p.name: k for k, p in enumerate(part.outputs)} for name, part in parts.items()}
        self.wires = [
            Wire(c.source[0], place[c.source[0]][c.source[1]], c.target[0], column[c.target[0]][c.target[1]], c)
            for c in scene.connections
        ]
        self._signals: list[tuple[str, int, Signal]] = [
            (m.name, column[m.name][name], signal) for m in scene.members for name, signal in m.signals.items()
        ]
        self._visits = _visits(parts, scene.connections)
        self._slices: dict[str, slice] = {}

    def start(self, time: float, piece: Piece) -> np.ndarray:
        """Consistent values at the start; the states there."""
        self._drive(time, piece)
        for name in self._visits:
            self._pass_on(name, self.parts[name].initialise(time, self._inputs[name]))
        for name, part in self.parts.items():
            part.initialise(time, self._inputs[name])
        states = [part.begin() for part in self.parts.values()]
        ends = np.cumsum([0, *(x.size for x in states)])
        self._slices = {name: slice(*ends[k : k + 2]) for k, name in enumerate(self.parts)}
        return np.concatenate(states)

    def place(self, time: float, states: np.ndarray, piece: Piece) -> None:
        """All parts at that time and state, inputs and outputs consistent. piece: decides at its ends."""
        for name, part in self.parts.items():
            part.place(time, states[self._slices[name]])
        self._drive(time, piece)
        for name in self._visits:
            self.parts[name].feed(self._inputs[name])
            self._pass_on(name, self.parts[name].values())
        for name, part in self.parts.items():
            part.feed(self._inputs[name])

    def rates(self) -> np.ndarray:
        return np.concatenate([part.rates() for part in self.parts.values()])

    def record(self) -> dict[str, np.ndarray]:
        return {name: part.record() for name, part in self.parts.items()}

    def nominals(self) -> np.ndarray:
        return np.concatenate([part.nominals for part in self.parts.values()])

    def inputs(self, name: str) -> np.ndarray:
        return self._inputs[name].copy()

    def _drive(self, time: float, piece: Piece) -> None:
        # A signal is asked for the step whose middle is the middle of the piece, so that a jump at an end of the piece
        # is never seen from the wrong side.
        length = piece[0] + piece[1] - 2.0 * time
        for name, column, signal in self._signals:
            self._inputs[name][column] = signal.polynomial(time, length if abs(length) > _INSTANT else _INSTANT)[0]

    def _pass_on(self, name: str, values: np.ndarray) -> None:
        for wire in self.wires:
            if wire.source == name:
                transformation = wire.connection
                self._inputs[wire.target][wire.input] = (
                    transformation.factor * values[wire.output] + transformation.offset
                )


@contextlib.contextmanager
def assembled(scene: Scene) -> Iterator[System]:
    """The system of a scene that is closed_inside(). Raises SceneError, SubsystemError."""
    with contextlib.ExitStack() as stack:
        for member in scene.members:
            stack.callback(member.archive.close)
        yield System(scene, {m.name: stack.enter_context(contextlib.closing(_part(scene, m))) for m in scene.members})


def _part(scene: Scene, member: Member) -> Part:
    fed = [c.target[1] for c in scene.connections if c.target[0] == member.name]
    outputs = list(dict.fromkeys(c.source[1] for c in scene.connections if c.source[0] == member.name))
    kind = Equilibrium if member.value("dynamic") is False else Model
    return kind(member, [*fed, *member.signals], outputs, [v.name for v in recorded_variables(member)])


def _visits(parts: dict[str, Part], connections: tuple[Connection, ...]) -> list[str]:
    """Parts in the order in which their outputs are read, so that what acts at once is known."""
    graph = nx.DiGraph()
    for name, part in parts.items():
        for port in part.outputs:
            graph.add_node((name, port.name))
            for c in connections:
                if c.target[0] == name and c.target[1] in part.follows(port.name):
                    graph.add_edge(c.source, (name, port.name))
    try:
        order = [name for name, _ in nx.lexicographical_topological_sort(graph, key=str)]
    except nx.NetworkXUnfeasible:
        loop = " -> ".join(".".join(edge[0]) for edge in nx.find_cycle(graph))
        raise SceneError(
            f"monolith: the outputs {loop} depend on each other at once; it has no solver for such a loop, "
            "remove one of the connections"
        ) from None
    return [name for k, name in enumerate(order) if k == 0 or order[k - 1] != name]
