"""Who feeds whom: connections between subsystems, and the order in which a sweep takes them.

Strongly connected components of the graph are the loops; what lies before a loop is stepped once per macro step, not
once per sweep. Inside a loop, in the given order, a connection that runs backwards (or to the same subsystem) is
torn: its end value is the loop's unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx

__all__ = ["Connection", "Loop", "loops"]


@dataclass(frozen=True)
class Connection:
    """source and target: (subsystem, variable)."""

    source: tuple[str, str]
    target: tuple[str, str]

    def __str__(self) -> str:
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


@dataclass(frozen=True)
class Loop:
    """Subsystems that depend on each other, in the order of a sweep, and the connections torn; none torn: no loop."""

    members: tuple[str, ...]
    torn: frozenset[Connection]


def loops(names: Sequence[str], connections: Sequence[Connection], jacobi: bool = False) -> tuple[Loop, ...]:
    """The loops in the order in which a macro step takes them. names: all subsystems, in the order wished for within
    a loop; jacobi: inside a loop tear every connection, so that no member sees what another has just done."""
    graph = nx.DiGraph()
    graph.add_nodes_from(names)
    graph.add_edges_from((c.source[0], c.target[0]) for c in connections)
    condensed = nx.condensation(graph)
    place = {name: k for k, name in enumerate(names)}
    found = []
    for node in nx.lexicographical_topological_sort(
        condensed, key=lambda n: min(place[name] for name in condensed.nodes[n]["members"])
    ):
        members = condensed.nodes[node]["members"]
        inner = [c for c in connections if c.source[0] in members and c.target[0] in members]
        torn = frozenset(c for c in inner if jacobi or place[c.source[0]] >= place[c.target[0]])
        found.append(Loop(tuple(sorted(members, key=place.__getitem__)), torn))
    return tuple(found)
