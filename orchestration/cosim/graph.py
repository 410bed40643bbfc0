"""The coupling graph: subsystems with their wiring as index arrays, in the order of a macro step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SubsystemError
from .extrapolation import Extrapolation
from .interface import InterfaceVector, TornOutputs
from .node import Columns, DrivenInput, Link, Node
from .settings import Coupling
from .signals import Constant, Signal
from .subsystem import Subsystem
from .topology import Component, Connection, components

__all__ = ["WiredComponent", "assemble"]


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
        At most one into each input.
    signals : mapping
        Subsystem name -> input name -> signal.
    settings : Coupling
        Schedule, exchange and waveform.

    Raises
    ------
    SubsystemError
        Where a subsystem lacks what exchange or waveform needs.
    """
    nodes = {s.name: _node(s, signals.get(s.name, {})) for s in subsystems}
    wired = []
    for component in components(list(nodes), connections, settings.schedule == "jacobi"):
        for name in component.members:
            into = [c for c in connections if c.target[0] == name]
            inside = [c for c in into if c.source[0] in component.members and c not in component.torn]
            node = nodes[name]
            node.upstream = _links(nodes, name, [c for c in into if c.source[0] not in component.members])
            node.moving_upstream = [link for link in node.upstream if not link.source.subsystem.frozen]
            node.forward = _links(nodes, name, inside)
            links = _links(nodes, name, [c for c in into if c in component.torn])
            node.torn = [link for link in links if not link.held]
            node.delayed = [link for link in links if link.held]
        wired.append(_wired(nodes, component, settings.torn))
    for node in nodes.values():
        continuous = [link for link in node.upstream + node.forward if not link.held]
        for links, method in ((continuous, settings.forward), (node.torn, settings.torn)):
            if links and method.order > 1 and not node.subsystem.takes_polynomials:
                raise SubsystemError(
                    f"{node.subsystem.name} cannot interpolate inputs, so it sees held ones only; "
                    "set coupling.exchange and coupling.waveform to 'held'"
                )
            for link in links:
                _request_rates(link.source, method)
    return tuple(wired)


def _request_rates(node: Node, method: Extrapolation) -> None:
    """Let the samples of a node carry rates where the method uses them. Raises SubsystemError where it needs them."""
    offered = node.subsystem.has_rates
    if method.needs_derivatives and not offered:
        raise SubsystemError(
            f"{node.subsystem.name} offers no output derivatives, which '{method.name}' needs; "
            "set coupling.exchange and coupling.waveform to 'held', 'linear' or 'quadratic'"
        )
    node.needs_rates |= method.uses_rates and offered


def _node(subsystem: Subsystem, signals: Mapping[str, Signal]) -> Node:
    column = {port.name: k for k, port in enumerate(subsystem.inputs)}
    inputs = np.zeros((4, len(subsystem.inputs)))
    inputs[0] = [port.start for port in subsystem.inputs]
    driven = tuple(DrivenInput(column[name], signal) for name, signal in signals.items())
    varying = tuple(pair for pair in driven if not isinstance(pair.signal, Constant))
    return Node(subsystem, driven, varying, inputs)


def _links(nodes: Mapping[str, Node], target: str, connections: Sequence[Connection]) -> list[Link]:
    """Return one link per source, and another one for its discrete values."""
    inputs = nodes[target].subsystem.inputs
    into = {port.name: k for k, port in enumerate(inputs)}
    links = []
    for name in dict.fromkeys(c.source[0] for c in connections):
        outputs = nodes[name].subsystem.outputs
        out = {port.name: k for k, port in enumerate(outputs)}
        pairs = [(out[c.source[1]], into[c.target[1]]) for c in connections if c.source[0] == name]
        for held in (False, True):
            alike = [(k, n) for k, n in pairs if held == (outputs[k].discrete or inputs[n].discrete)]
            if alike:
                columns, targets = (_columns(indices) for indices in np.array(alike, dtype=int).T)
                links.append(Link(nodes[name], columns, targets, held))
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
    interface = InterfaceVector(outputs, [waveform.needs_derivatives] * len(outputs))
    return WiredComponent(tuple(nodes[name] for name in component.members), interface)
