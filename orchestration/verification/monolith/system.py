"""The members of a scene as one system x' = f(t, x) with events.

Outputs feed inputs in an order in which each is known before it acts (an algebraic loop has none and is refused). A
TCA loop that the scene leaves to the master, delta -> delta_guess, is closed inside the rod instead.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import NamedTuple

import networkx as nx
import numpy as np

from ...cosim.signals import Signal
from ...cosim.topology import Connection
from ...errors import SceneError, SubsystemError
from ...scene import Member, Scene
from ...scene.manipulator import ROD
from ...simulation import recorded_variables
from .model_exchange import ModelExchangePart
from .part import Part, QuasiStaticPart

__all__ = ["System", "Wire", "assembled"]

_INSTANT = 1e-9  # [s] length of the step at whose start a signal is evaluated at an end of an interval
_UPDATES = 1000  # of discrete states at one instant, after which the system is taken not to settle

Interval = tuple[float, float]  # between two breaks of the signals [s]


class Wire(NamedTuple):
    """A connection by columns: an output of the part `source` feeds an input of the part `target`."""

    source: str
    output: int
    target: str
    input: int
    connection: Connection


class System:
    """The coupled parts, in the scene's order. Made by assembled()."""

    def __init__(self, scene: Scene, parts: dict[str, Part]) -> None:
        self.parts = parts
        self._inputs = {name: np.array([port.start for port in part.inputs]) for name, part in parts.items()}
        inputs = {name: {p.name: k for k, p in enumerate(part.inputs)} for name, part in parts.items()}
        outputs = {name: {p.name: k for k, p in enumerate(part.outputs)} for name, part in parts.items()}
        self.wires: list[Wire] = [
            Wire(c.source[0], outputs[c.source[0]][c.source[1]], c.target[0], inputs[c.target[0]][c.target[1]], c)
            for c in scene.connections
        ]
        self._signals: list[tuple[str, int, Signal]] = [
            (m.name, inputs[m.name][name], signal) for m in scene.members for name, signal in m.signals.items()
        ]
        self._sums: dict[tuple[str, str], list[float]] = {}  # input -> terms, where a sum feeds it
        self._order = _evaluation_order(parts, scene.connections)
        self._slices: dict[str, slice] = {}

    def start(self, time: float, interval: Interval) -> np.ndarray:
        """Initialise consistently; the states (n,) at the start."""
        self._set_signals(time, interval)
        for name in self._order:
            self._pass_on(name, self.parts[name].initialise(time, self._inputs[name]))
        for name, part in self.parts.items():
            part.initialise(time, self._inputs[name])
        states = [part.begin() for part in self.parts.values()]
        ends = np.cumsum([0, *(x.size for x in states)])
        self._slices = {name: slice(*ends[k : k + 2]) for k, name in enumerate(self.parts)}
        return np.concatenate(states)

    def set_state(self, time: float, states: np.ndarray, interval: Interval) -> None:
        """Set all parts to that time [s] and state (n,), inputs and outputs consistent.

        interval: decides at its ends which side of a jump of a signal holds.
        """
        for name, part in self.parts.items():
            part.set_state(time, states[self._slices[name]])
        self._set_signals(time, interval)
        self._pass_all()

    def rates(self) -> np.ndarray:
        """Time derivatives (n,) of the states now."""
        return np.concatenate([part.rates() for part in self.parts.values()])

    @property
    def indicator_count(self) -> int:
        """Number of event indicators n_z."""
        return sum(part.indicator_count for part in self.parts.values())

    def indicators(self) -> np.ndarray:
        """Event indicators (n_z,) now."""
        return np.concatenate([part.indicators() for part in self.parts.values()])

    @property
    def next_event(self) -> float:
        """Time of the next time event [s]; inf: none."""
        return min(part.next_event for part in self.parts.values())

    def completed_step(self) -> tuple[bool, str]:
        """Tell all parts the end of an integrator step; whether one needs an event, and which wishes to end."""
        needed, ending = False, ""
        for name, part in self.parts.items():
            event, terminate = part.completed_step()
            needed, ending = needed or event, ending or (name if terminate else "")
        return needed, ending

    def handle_event(self, time: float, states: np.ndarray, interval: Interval) -> tuple[np.ndarray, str]:
        """Update discrete states of all parts at an event until none changes any more.

        Returns the states (n,) after it, and the name of a part that wishes to end. Raises SubsystemError where
        discrete states do not settle.
        """
        self.set_state(time, states, interval)
        for part in self.parts.values():
            part.enter_events()
        ending = ""
        for _ in range(_UPDATES):
            updates = {name: part.update_discrete() for name, part in self.parts.items()}
            ending = ending or next((name for name, update in updates.items() if update.terminate), "")
            before = {name: values.copy() for name, values in self._inputs.items()}
            self._pass_all()
            moved = any(not np.array_equal(values, before[name]) for name, values in self._inputs.items())
            if ending or not (moved or any(update.again for update in updates.values())):
                return np.concatenate([part.leave_events() for part in self.parts.values()]), ending
        raise SubsystemError(
            f"monolith: discrete states of {', '.join(self.parts)} do not settle at t = {time:.6g} s "
            f"({_UPDATES} updates); look for a loop of discrete variables without delay"
        )

    def record(self) -> dict[str, np.ndarray]:
        """Recorded variables of each part now."""
        return {name: part.record() for name, part in self.parts.items()}

    def nominals(self) -> np.ndarray:
        """Nominal values (n,) of the states."""
        return np.concatenate([part.nominals for part in self.parts.values()])

    def inputs(self, name: str) -> np.ndarray:
        """Input values (n_u,) of a part now."""
        return self._inputs[name].copy()

    def _pass_all(self) -> None:
        for name in self._order:
            self.parts[name].set_inputs(self._inputs[name])
            self._pass_on(name, self.parts[name].values())
        for name, part in self.parts.items():
            part.set_inputs(self._inputs[name])

    def _set_signals(self, time: float, interval: Interval) -> None:
        # A signal is evaluated for the step whose middle is that of the interval, so that a jump at an end of the
        # interval is never taken from the wrong side.
        length = interval[0] + interval[1] - 2.0 * time
        for name, column, signal in self._signals:
            self._inputs[name][column] = signal.polynomial(time, length if abs(length) > _INSTANT else _INSTANT)[0]

    def _pass_on(self, name: str, values: np.ndarray) -> None:
        for wire in self.wires:
            if wire.source == name:
                c = wire.connection
                value = c.factor * values[wire.output] + c.offset
                if c.terms > 1:
                    terms = self._sums.setdefault(c.target, [0.0] * c.terms)
                    terms[c.term] = value
                    value = sum(terms)
                self._inputs[wire.target][wire.input] = value


@contextlib.contextmanager
def assembled(scene: Scene) -> Iterator[System]:
    """The system of a scene that is closed_inside(); freed at the end. Raises SceneError, SubsystemError."""
    _refuse_discrete_wires(scene)
    if scene.start_time:
        raise SceneError(f"{scene.name}: start_time = {scene.start_time:g} s: the monolith starts at 0 s; remove it")
    with contextlib.ExitStack() as stack:
        for member in scene.members:
            stack.callback(member.archive.close)
        yield System(scene, {m.name: stack.enter_context(contextlib.closing(_part(scene, m))) for m in scene.members})


def _refuse_discrete_wires(scene: Scene) -> None:
    archives = {m.name: m.archive for m in scene.members}
    for connection in scene.connections:
        kinds = [archives[end[0]].variables[end[1]].type for end in (connection.source, connection.target)]
        if kinds != ["Real", "Real"]:
            raise SceneError(
                f"monolith: {connection} connects {' to '.join(kinds)}; the monolith passes Real values only, run the "
                "scene as co-simulation"
            )


def _part(scene: Scene, member: Member) -> Part:
    wired = dict.fromkeys(c.target[1] for c in scene.connections if c.target[0] == member.name)
    outputs = list(dict.fromkeys(c.source[1] for c in scene.connections if c.source[0] == member.name))
    quasi_static = member.archive.description.model_name == ROD and member.value("dynamic") is False
    kind = QuasiStaticPart if quasi_static else ModelExchangePart
    return kind(member, [*wired, *member.signals], outputs, [v.name for v in recorded_variables(member)])


def _evaluation_order(parts: dict[str, Part], connections: tuple[Connection, ...]) -> list[str]:
    """Names of the parts in the order in which outputs are read, so that each input is known before it acts."""
    graph = nx.DiGraph()
    for name, part in parts.items():
        for port in part.outputs:
            graph.add_node((name, port.name))
            for c in connections:
                if c.target[0] == name and c.target[1] in part.direct_inputs(port.name):
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
