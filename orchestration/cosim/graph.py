"""The coupling graph: subsystems with their wiring as index arrays, in the order of a macro step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .extrapolation import Extrapolation, available
from .interface import InterfaceVector, TornOutputs
from .node import Columns, DrivenInput, Link, Node
from .settings import Coupling
from .signals import Constant, Signal
from .subsystem import Subsystem
from .topology import Component, Connection, components

__all__ = ["WiredComponent", "assemble"]

MAX_DEGREE = 3  # of input polynomials


@dataclass(eq=False)
class WiredComponent:
    """A strongly connected component of the graph.

    Attributes
    ----------
    nodes : tuple of Node
        In sweep order.
    interface : InterfaceVector
        Unknowns of the loop; of size 0 where there is none.
    """

    nodes: tuple[Node, ...]
    interface: InterfaceVector


def assemble(
    subsystems: Sequence[Subsystem],
    connections: Sequence[Connection],
    signals: Mapping[str, Mapping[str, Signal]],
    settings: Coupling,
) -> tuple[WiredComponent, ...]:
    """Return the components in the order in which a macro step takes them.

    Parameters
    ----------
    subsystems : sequence of Subsystem
        In the order wanted inside a loop.
    connections : sequence of Connection
        At most one into each port of a subsystem; the terms of a sum have ports of their own.
    signals : mapping
        Subsystem name -> input name -> signal.
    settings : Coupling
        Schedule, exchange and waveform.
    """
    nodes = {s.name: _node(s, signals.get(s.name, {})) for s in subsystems}
    wired = []
    for component in components(list(nodes), connections, settings.schedule == "jacobi"):
        for name in component.members:
            into = [c for c in connections if c.target[0] == name]
            inside = [c for c in into if c.source[0] in component.members and c not in component.torn]
            node = nodes[name]
            outside = [c for c in into if c.source[0] not in component.members]
            node.upstream = _links(nodes, name, outside, settings.forward)
            node.moving_upstream = [link for link in node.upstream if not link.source.subsystem.frozen]
            node.forward = _links(nodes, name, inside, settings.forward)
            links = _links(nodes, name, [c for c in into if c in component.torn], settings.torn)
            node.torn = [link for link in links if not link.held]
            node.delayed = [link for link in links if link.held]
            for link in node.upstream + node.forward + node.torn:
                link.source.needs_rates |= link.method.uses_rates and link.source.subsystem.has_rates and not link.held
        wired.append(_wired(nodes, component, settings.torn))
    return tuple(wired)


def _node(subsystem: Subsystem, signals: Mapping[str, Signal]) -> Node:
    column = {port.name: k for k, port in enumerate(subsystem.inputs)}
    inputs = np.zeros((4, len(subsystem.inputs)))
    inputs[0] = [port.start for port in subsystem.inputs]
    driven = tuple(DrivenInput(column[name], signal) for name, signal in signals.items())
    varying = tuple(pair for pair in driven if not isinstance(pair.signal, Constant))
    return Node(subsystem, driven, varying, inputs, degree=MAX_DEGREE if subsystem.takes_polynomials else 0)


def _links(
    nodes: Mapping[str, Node], target: str, connections: Sequence[Connection], asked: Extrapolation
) -> list[Link]:
    """Return one link per source, and another one for its discrete values."""
    inputs = nodes[target].subsystem.inputs
    into = {port.name: k for k, port in enumerate(inputs)}
    links = []
    degree = nodes[target].degree
    for name in dict.fromkeys(c.source[0] for c in connections):
        outputs = nodes[name].subsystem.outputs
        out = {port.name: k for k, port in enumerate(outputs)}
        pairs = [(out[c.source[1]], into[c.port]) for c in connections if c.source[0] == name]
        for held in (False, True):
            alike = [(k, n) for k, n in pairs if held == (outputs[k].discrete or inputs[n].discrete)]
            if alike:
                columns, targets = (_columns(indices) for indices in np.array(alike, dtype=int).T)
                method = available(asked, degree, nodes[name].subsystem.has_rates)
                links.append(Link(nodes[name], columns, targets, method, held))
    return links


def _columns(indices: np.ndarray) -> Columns:
    first, end = int(indices[0]), int(indices[-1]) + 1
    return slice(first, end) if np.array_equal(indices, np.arange(first, end)) else indices


def _wired(nodes: Mapping[str, Node], component: Component, waveform: Extrapolation) -> WiredComponent:
    outputs = []
    for name in component.members:
        ports = nodes[name].subsystem.outputs
        wanted = np.zeros(len(ports), dtype=bool)
        for link in (link for member in component.members for link in nodes[member].torn):
            if link.source is nodes[name]:
                wanted[link.columns] = True
        columns = np.flatnonzero(wanted)
        if columns.size:
            outputs.append(TornOutputs(nodes[name], columns, np.array([ports[k].nominal for k in columns])))
    with_rates = [waveform.needs_derivatives and torn.node.subsystem.has_rates for torn in outputs]
    interface = InterfaceVector(outputs, with_rates)
    return WiredComponent(tuple(nodes[name] for name in component.members), interface)
