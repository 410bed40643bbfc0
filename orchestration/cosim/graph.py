"""Subsystems with their wiring as index arrays, ready to be swept.

A node keeps the polynomials (4, n_u) of its inputs and the samples of its wired outputs. Links copy columns: from a
source's output polynomials to a target's input polynomials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import SubsystemError
from .extrapolation import NOTHING, Exchange, Sample
from .signals import Constant, Signal
from .subsystem import Subsystem
from .topology import Connection, Loop, loops

__all__ = ["Circuit", "Link", "Node", "assemble"]

Columns = np.ndarray | slice  # a slice where they run on, which numpy copies several times faster


@dataclass(eq=False)
class Link:
    """All connections from one source to one target that are torn, or that are not."""

    source: Node
    columns: Columns  # of the source's outputs
    targets: Columns  # of the target's inputs


@dataclass(eq=False)
class Node:
    subsystem: Subsystem
    signals: tuple[tuple[int, Signal], ...]  # input column and what drives it
    varying: tuple[tuple[int, Signal], ...]  # of these those that are not constant
    inputs: np.ndarray  # (4, n_u) polynomials for the step to come; what never varies is in them from the start on
    given: list[Link] = field(default_factory=list)  # into this node, from circuits done before its own
    moving: list[Link] = field(default_factory=list)  # of these those whose source does not rest
    forward: list[Link] = field(default_factory=list)  # into this node, from nodes before it in the same sweep
    torn: list[Link] = field(default_factory=list)  # into this node, end value guessed or extrapolated
    needs_rates: bool = False
    samples: tuple[Sample, ...] = ()  # newest last; cut at events
    now: Sample = NOTHING  # end of the step under way

    def sample(self, time: float) -> Sample:
        """The wired outputs at the present time of the subsystem."""
        return Sample(time, self.subsystem.values(), self.subsystem.rates() if self.needs_rates else None)


@dataclass(eq=False)
class Circuit:
    """One loop, or a single node without one, in sweep order. unknowns: per source of a torn link the node, the
    columns of its outputs and their nominals; scale: nominals of the interface vector."""

    nodes: tuple[Node, ...]
    unknowns: tuple[tuple[Node, np.ndarray, np.ndarray], ...]
    scale: np.ndarray


def assemble(
    subsystems: Sequence[Subsystem],
    connections: Sequence[Connection],
    signals: Mapping[str, Mapping[str, Signal]],
    exchange: Exchange,
    waveform: Exchange,
    jacobi: bool = False,
) -> tuple[Circuit, ...]:
    """The circuits in the order in which a macro step takes them. signals: per subsystem name, per input name."""
    nodes = {s.name: _node(s, signals.get(s.name, {})) for s in subsystems}
    circuits = []
    for loop in loops(list(nodes), connections, jacobi):
        for name in loop.members:
            into = [c for c in connections if c.target[0] == name]
            inside = [c for c in into if c.source[0] in loop.members and c not in loop.torn]
            nodes[name].given = _links(nodes, name, [c for c in into if c.source[0] not in loop.members])
            nodes[name].moving = [link for link in nodes[name].given if not link.source.subsystem.frozen]
            nodes[name].forward = _links(nodes, name, inside)
            nodes[name].torn = _links(nodes, name, [c for c in into if c in loop.torn])
        circuits.append(_circuit(nodes, loop, waveform))
    for node in nodes.values():
        for links, method in ((node.given + node.forward, exchange), (node.torn, waveform)):
            if links and method.order > 1 and not node.subsystem.takes_polynomials:
                raise SubsystemError(
                    f"{node.subsystem.name} cannot interpolate inputs, so it sees held ones only; "
                    "set coupling.exchange and coupling.waveform to 'held'"
                )
            for link in links:
                _ask_for_rates(link.source, method)
    return tuple(circuits)


def _ask_for_rates(node: Node, method: Exchange) -> None:
    offered = node.subsystem.has_rates
    if method.slopes and not offered:
        raise SubsystemError(
            f"{node.subsystem.name} offers no output derivatives, which '{method.name}' needs; "
            "set coupling.exchange and coupling.waveform to 'held', 'linear' or 'quadratic'"
        )
    node.needs_rates |= method.rates and offered


def _node(subsystem: Subsystem, signals: Mapping[str, Signal]) -> Node:
    column = {port.name: k for k, port in enumerate(subsystem.inputs)}
    inputs = np.zeros((4, len(subsystem.inputs)))
    inputs[0] = [port.start for port in subsystem.inputs]
    driven = tuple((column[name], signal) for name, signal in signals.items())
    varying = tuple(pair for pair in driven if not isinstance(pair[1], Constant))
    return Node(subsystem, driven, varying, inputs)


def _links(nodes: Mapping[str, Node], target: str, connections: Sequence[Connection]) -> list[Link]:
    into = {port.name: k for k, port in enumerate(nodes[target].subsystem.inputs)}
    links = []
    for name in dict.fromkeys(c.source[0] for c in connections):
        out = {port.name: k for k, port in enumerate(nodes[name].subsystem.outputs)}
        pairs = [(out[c.source[1]], into[c.target[1]]) for c in connections if c.source[0] == name]
        columns, targets = (_columns(places) for places in np.array(pairs, dtype=int).T)
        links.append(Link(nodes[name], columns, targets))
    return links


def _columns(places: np.ndarray) -> Columns:
    first, end = int(places[0]), int(places[-1]) + 1
    return slice(first, end) if np.array_equal(places, np.arange(first, end)) else places


def _circuit(nodes: Mapping[str, Node], loop: Loop, waveform: Exchange) -> Circuit:
    unknowns, scale = [], []
    for name in loop.members:
        wanted = {c.source[1] for c in loop.torn if c.source[0] == name}
        ports = nodes[name].subsystem.outputs
        columns = np.array([k for k, port in enumerate(ports) if port.name in wanted], dtype=int)
        if columns.size:
            nominals = np.array([ports[k].nominal for k in columns])
            unknowns.append((nodes[name], columns, nominals))
            # Where a waveform has end slopes they are unknowns too, times the step length.
            scale.append(np.tile(nominals, 2 if waveform.slopes else 1))
    return Circuit(tuple(nodes[name] for name in loop.members), tuple(unknowns), np.concatenate([*scale, []]))
