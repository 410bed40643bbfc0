"""The graph of connections between subsystems, and the order in which a macro step takes them.

Strongly connected components of the graph are the loops; a component before a loop is stepped once per macro step,
not once per sweep. Inside a component, in the given order, a connection that runs backwards (or to the same subsystem)
is torn: its end value is an unknown of the loop.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

__all__ = ["Component", "Connection", "components"]


@dataclass(frozen=True)
class Connection:
    """A wire from an output to an input, each a pair (subsystem, variable).

    The target receives factor * value + offset.

    Several wires into one input are the terms of a sum, which the target receives: term counts them from 0, terms says
    how many there are.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    factor: float = 1.0
    offset: float = 0.0
    term: int = 0
    terms: int = 1

    @property
    def transforms(self) -> bool:
        """Whether the target receives another number than the source gives."""
        return (self.factor, self.offset) != (1.0, 0.0) or self.terms > 1

    @property
    def port(self) -> str:
        """Name under which the coupling knows the input: that of the variable, or one for each term of a sum."""
        return self.target[1] if self.terms == 1 else f"{self.target[1]} (term {self.term + 1} of {self.terms})"

    def __str__(self) -> str:
        """Return 'a.y -> b.u', 'a.y * 1000 + 5 -> b.u', or with a name for each term of a sum."""
        factor = "" if self.factor == 1.0 else f" * {self.factor:g}"
        offset = "" if self.offset == 0.0 else f" {'-' if self.offset < 0.0 else '+'} {abs(self.offset):g}"
        return f"{'.'.join(self.source)}{factor}{offset} -> {self.target[0]}.{self.port}"


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
    return _components(tuple(names), tuple(connections), jacobi)


@lru_cache(maxsize=64)  # graphs of the scenes that a process runs again and again
def _components(names: tuple[str, ...], connections: tuple[Connection, ...], jacobi: bool) -> tuple[Component, ...]:
    rank = {name: k for k, name in enumerate(names)}
    after = _neighbours(names, ((c.source[0], c.target[0]) for c in connections))
    groups = _strongly_connected(names, after)
    of = {name: k for k, group in enumerate(groups) for name in group}
    waiting = [len({of[c.source[0]] for c in connections if of[c.target[0]] == k} - {k}) for k in range(len(groups))]
    ready = [(min(map(rank.__getitem__, group)), k) for k, group in enumerate(groups) if not waiting[k]]
    heapq.heapify(ready)
    ordered = []
    while ready:  # the first in the given order of those whose sources are all taken
        _, number = heapq.heappop(ready)
        members = groups[number]
        inner = [c for c in connections if c.source[0] in members and c.target[0] in members]
        torn = frozenset(c for c in inner if jacobi or rank[c.source[0]] >= rank[c.target[0]])
        ordered.append(Component(tuple(sorted(members, key=rank.__getitem__)), torn))
        for k in {of[name] for member in members for name in after[member]} - {number}:
            waiting[k] -= 1
            if not waiting[k]:
                heapq.heappush(ready, (min(map(rank.__getitem__, groups[k])), k))
    return tuple(ordered)


def _neighbours(names: Sequence[str], edges: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """Return name -> names that its edges lead to, each once."""
    after: dict[str, dict[str, None]] = {name: {} for name in names}
    for one, other in edges:
        after[one][other] = None
    return {name: list(others) for name, others in after.items()}


def _strongly_connected(names: Sequence[str], after: Mapping[str, list[str]]) -> list[frozenset[str]]:
    """Return the strongly connected components (Kosaraju and Sharir: two depth-first searches, one of them backwards).

    Networkx has them too, but loading it takes longer than a whole run.
    """
    finished = [name for tree in _depth_first(names, after) for name in tree]
    before = _neighbours(names, ((other, one) for one in names for other in after[one]))
    return [frozenset(tree) for tree in _depth_first(finished[::-1], before)]


def _depth_first(names: Sequence[str], after: Mapping[str, list[str]]) -> Iterator[list[str]]:
    """Yield the names of each tree of a depth-first search, in the order in which they are left."""
    seen: set[str] = set()
    for root in names:
        if root in seen:
            continue
        seen.add(root)
        left, path = [], [(root, iter(after[root]))]
        while path:
            name, others = path[-1]
            following = next((other for other in others if other not in seen), None)
            if following is None:
                left.append(name)
                path.pop()
            else:
                seen.add(following)
                path.append((following, iter(after[following])))
        yield left
