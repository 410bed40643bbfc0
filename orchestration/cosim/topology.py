"""The graph of connections between subsystems, and the order in which a macro step takes them.

Strongly connected components of the graph are the loops; a component before a loop is stepped once per macro step,
not once per sweep. Inside a component, in the given order, a connection that runs backwards (or to the same subsystem)
is torn: its end value is an unknown of the loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx

__all__ = ["Component", "Connection", "components"]


@dataclass(frozen=True)
class Connection:
    """A wire from an output to an input, each a pair (subsystem, variable); the target receives factor * value +
    offset."""

    source: tuple[str, str]
    target: tuple[str, str]
    factor: float = 1.0
    offset: float = 0.0

    @property
    def transforms(self) -> bool:
        """Whether the target receives another number than the source gives."""
        return (self.factor, self.offset) != (1.0, 0.0)

    def __str__(self) -> str:
        """Return 'a.y -> b.u', or 'a.y * 1000 + 5 -> b.u'."""
        factor = "" if self.factor == 1.0 else f" * {self.factor:g}"
        offset = "" if self.offset == 0.0 else f" {'-' if self.offset < 0.0 else '+'} {abs(self.offset):g}"
        return f"{'.'.join(self.source)}{factor}{offset} -> {'.'.join(self.target)}"


@dataclass(frozen=True)
class Component:
    """A strongly connected component.

    Attributes
    ----------
    members : tuple of str
        Subsystems in the order of a sweep.
    torn : frozenset of Connection
        Torn connections; empty for a single subsystem without a loop.
    """

    members: tuple[str, ...]
    torn: frozenset[Connection]


def components(names: Sequence[str], connections: Sequence[Connection], jacobi: bool = False) -> tuple[Component, ...]:
    """Return the strongly connected components in the order in which a macro step takes them.

    Parameters
    ----------
    names : sequence of str
        All subsystems, in the order wanted inside a loop.
    connections : sequence of Connection
        Edges of the graph.
    jacobi : bool
        Tear every connection inside a component, so that each member sees results of the sweep before only.
    """
    graph = nx.DiGraph()
    graph.add_nodes_from(names)
    graph.add_edges_from((c.source[0], c.target[0]) for c in connections)
    condensed = nx.condensation(graph)
    rank = {name: k for k, name in enumerate(names)}
    ordered = []
    for node in nx.lexicographical_topological_sort(
        condensed, key=lambda n: min(rank[name] for name in condensed.nodes[n]["members"])
    ):
        members = condensed.nodes[node]["members"]
        inner = [c for c in connections if c.source[0] in members and c.target[0] in members]
        torn = frozenset(c for c in inner if jacobi or rank[c.source[0]] >= rank[c.target[0]])
        ordered.append(Component(tuple(sorted(members, key=rank.__getitem__)), torn))
    return tuple(ordered)
