"""Weighted sums of a scene's wiring in SSP archives.

A connection of SSP 1.0 leads from one output to one input, which it may scale, and no second one may lead to that
input. So the writer puts an FMU between, sum.fmu of this package, with the weights as parameters:

    y = offset + gain[1] u[1] + ... + gain[12] u[12]

Weights are parameters, and not linear transformations of the connections, because some hosts ignore the latter. Hosts
that exchange values once per step get a sum one step later than a direct connection. The reader makes weighted sums of
these FMUs again, so that a scene that comes back has none of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import Any

from ..cosim.topology import Connection
from ..fmi.archive import Archive, cached_archive, find_fmu
from . import Scene

__all__ = ["SUM_FMU", "SumComponent", "is_sum", "sum_archive", "sum_components", "summed_sources"]

SUM_FMU = "sum.fmu"
_TERMS = 12  # of one sum.fmu
_CANCELLED = 1e-9  # sum of weights below which their rounding is all that is left
Source = tuple[str, str]  # component and output


@dataclass(frozen=True)
class SumComponent:
    """One sum.fmu of an archive."""

    name: str
    terms: tuple[tuple[Source, float], ...]  # sources of u[1], u[2], ... and their gains
    offset: float
    target: Source | None  # component and input that y feeds; None: another sum has it among its sources
    start: float  # of y, that of the input: hosts may evaluate what it feeds before its sources

    @property
    def values(self) -> dict[str, float]:
        """Values of its parameters, and start values of its inputs that give y its own."""
        gains = [gain for _, gain in self.terms]
        numbered = {f"gain[{k}]": gain for k, gain in enumerate(gains, 1)}
        starts = dict.fromkeys((f"u[{k + 1}]" for k in range(len(gains))), self.common_start)
        return {**numbered, "offset": self.offset, **starts}

    @property
    def common_start(self) -> float:
        """Start value that all its inputs have; 0 where their weights cancel."""
        whole = math.fsum(gain for _, gain in self.terms)
        return (self.start - self.offset) / whole if abs(whole) > _CANCELLED else 0.0


def sum_archive() -> Archive:
    """Open sum.fmu of this package. SceneError where it is not built."""
    return cached_archive(find_fmu(SUM_FMU))


def sum_components(scene: Scene) -> Iterator[SumComponent]:
    """Yield the sums that the archive of a scene needs, those first that others take as sources."""
    taken = {member.name for member in scene.members}
    names = (name for k in range(1, 10**6) if (name := f"sum{k}") not in taken)
    terms = sorted((c for c in scene.connections if c.terms > 1), key=lambda c: (c.target, c.term))
    for target, group in groupby(terms, key=lambda c: c.target):
        connections: Sequence[Connection] = list(group)
        start = scene.member(target[0]).value(target[1])
        whole = SumComponent(
            "",
            tuple((c.source, c.factor) for c in connections),
            math.fsum(c.offset for c in connections),
            target,
            float(start) if isinstance(start, (int, float)) else 0.0,
        )
        sources = list(whole.terms)
        while len(sources) > _TERMS:
            part = tuple(sources[:_TERMS])
            share = whole.common_start * math.fsum(gain for _, gain in part)
            yield (inner := SumComponent(next(names), part, 0.0, None, share))
            sources = [*sources[_TERMS:], ((inner.name, "y"), 1.0)]
        yield replace(whole, name=next(names), terms=tuple(sources))


@lru_cache(maxsize=64)
def is_sum(archive: Archive) -> bool:
    """Whether an FMU is sum.fmu of this package, by its GUID, which is a hash of its variables."""
    return archive.description.model_name == "sum" and archive.guid == sum_archive().guid


def summed_sources(
    entries: Sequence[Mapping[str, Any]], values: Mapping[str, Mapping[str, Any]], sums: Sequence[str]
) -> tuple[list[Mapping[str, Any]], set[str]]:
    """Replace sums between connections by weighted sums.

    Parameters
    ----------
    entries
        Connections as a scene has them: tables with from, to, factor, offset.
    values
        Component -> variable -> value that parameter sets give.
    sums
        Components that are sum.fmu.

    Returns
    -------
    tuple
        The connections of the system without these components, and the names of those that are gone. A sum stays an
        FMU where no weighted sum of outputs can stand in its place: of constants alone, or in a circle of sums.
    """
    feeding = {entry["to"]: entry for entry in entries}
    weighted: dict[str, tuple[dict[Source, float], float] | None] = {}

    def expand(name: str, passed: frozenset[str]) -> tuple[dict[Source, float], float] | None:
        """Return factors by source, and the offset; None where the sum stays."""
        own = values.get(name, {})
        factors: dict[Source, float] = {}
        offset = float(own.get("offset", 0.0))
        for k in range(1, _TERMS + 1):
            gain = float(own.get(f"gain[{k}]", 0.0))
            entry = feeding.get((name, f"u[{k}]"))
            if gain == 0.0:
                continue
            if entry is None:
                offset += gain * float(own.get(f"u[{k}]", 0.0))
                continue
            inner: tuple[dict[Source, float], float] | None = {entry["from"]: 1.0}, 0.0
            if entry["from"][0] in sums:
                inner = None if entry["from"][0] in passed else expand(entry["from"][0], passed | {name})
            if inner is None:
                return None
            scale = gain * entry["factor"]
            for source, factor in inner[0].items():
                factors[source] = factors.get(source, 0.0) + scale * factor
            offset += scale * inner[1] + gain * entry["offset"]
        usable = factors and all(factor and math.isfinite(factor) for factor in factors.values())
        return (factors, offset) if usable else None

    for name in sums:
        weighted[name] = expand(name, frozenset({name}))
    gone = {name for name, terms in weighted.items() if terms is not None}
    gone -= {e["from"][0] for e in entries if e["to"][0] in sums and e["to"][0] not in gone}  # what stays needs them
    kept: list[Mapping[str, Any]] = []
    for entry in entries:
        if entry["to"][0] in gone:
            continue
        terms = weighted[entry["from"][0]] if entry["from"][0] in gone else None
        kept.append(entry if terms is None else _entry(entry, *terms))
    return kept, gone


def _entry(entry: Mapping[str, Any], factors: Mapping[Source, float], offset: float) -> Mapping[str, Any]:
    """Return the connection of an input to a weighted sum; the whole offset stands at its first term."""
    terms = [
        {"from": source, "factor": entry["factor"] * factor, "offset": 0.0, "convert": False}
        for source, factor in factors.items()
    ]
    terms[0]["offset"] = entry["factor"] * offset + entry["offset"]
    return {"terms": terms, "to": entry["to"]} if len(terms) > 1 else {**terms[0], "to": entry["to"]}
