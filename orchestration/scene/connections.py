"""Who feeds whom in a scene. Connected variables have one unit; where an FMU declares none, any fits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..cosim.topology import Connection
from ..fmi.archive import Variable, similar
from .members import Member
from .validation import Layer

__all__ = ["wired"]

# source, target, and when: by default equal names are wired; what the master must iterate only where it acts.
DEFAULT_WIRING: tuple[tuple[str, str, Callable[[Mapping[str, Member]], bool]], ...] = (
    ("thermal.T", "rod.T", lambda members: True),
    ("rod.delta", "rod.delta_guess", lambda members: members["rod"].value("closure") == 2),
    ("rod.delta", "thermal.delta", lambda members: members["thermal"].value("tca.beta") != 0.0),
)


def wired(members: Mapping[str, Member], given: tuple[Any, Layer] | None) -> tuple[Connection, ...]:
    """The connections given, or the default ones whose target no signal drives. members: by name. Raises SceneError."""
    if given is None:
        pairs = [
            p for p in DEFAULT_WIRING if {p[0].split(".")[0], p[1].split(".")[0]} <= set(members) and p[2](members)
        ]
        found = [
            c for source, target, _ in pairs for c in _connect(members, source, target, Layer("default wiring", "", {}))
        ]
        found = [c for c in found if c.target[1] not in members[c.target[0]].signals]
    else:
        found = _given_connections(members, *given)
    return tuple(found)


def _given_connections(members: Mapping[str, Member], texts: Any, layer: Layer) -> list[Connection]:
    found: dict[tuple[str, str], Connection] = {}
    if not isinstance(texts, list):
        layer.refuse("connections", texts, "wants a list of 'fmu.output -> fmu.input'")
    for text in texts:
        source, arrow, target = text.partition("->") if isinstance(text, str) else ("", "", "")
        if not arrow:
            layer.refuse("connections", text, "wants 'fmu.output -> fmu.input'")
        for connection in _connect(members, source.strip(), target.strip(), layer):
            if connection.target[1] in members[connection.target[0]].signals:
                layer.refuse(
                    "connections", text, f"{'.'.join(connection.target)} is set as well; remove one of the two"
                )
            if connection.target in found:
                layer.refuse("connections", text, f"{'.'.join(connection.target)} is fed twice; remove one")
            found[connection.target] = connection
    return list(found.values())


def _connect(members: Mapping[str, Member], source: str, target: str, layer: Layer) -> list[Connection]:
    text = f"{source} -> {target}"
    ends = [
        _variables(members, end, causality, text, layer) for end, causality in ((source, "output"), (target, "input"))
    ]
    if len(ends[0]) != len(ends[1]):
        layer.refuse("connections", text, f"{len(ends[0])} outputs for {len(ends[1])} inputs; the counts must agree")
    for (_, a), (_, b) in zip(*ends, strict=True):
        if a.measured and b.measured and (a.dimension, a.unit) != (b.dimension, b.unit):
            layer.refuse("connections", text, f"units differ: {a.unit!r} and {b.unit!r}; connect variables of one unit")
    return [Connection((m, a.name), (n, b.name)) for (m, a), (n, b) in zip(*ends, strict=True)]


def _variables(
    members: Mapping[str, Member], end: str, causality: str, text: str, layer: Layer
) -> list[tuple[str, Variable]]:
    name, _, key = end.partition(".")
    if name not in members:
        layer.refuse("connections", text, f"no FMU {name!r}; {similar(name, list(members))}")
    archive = members[name].archive
    scalars = [key] if key in archive.variables else list(archive.vectors.get(key, ()))
    fit = [
        (name, archive.variables[v])
        for v in scalars
        if archive.variables[v].causality == causality and archive.variables[v].type == "Real"
    ]
    if not fit or len(fit) != len(scalars):
        known = [v.name for v in archive.variables.values() if v.causality == causality and v.type == "Real"]
        bases = [base for base, elements in archive.vectors.items() if elements[0] in known]
        layer.refuse("connections", text, f"{end!r} is no Real {causality}; {similar(key, [*known, *bases])}")
    return fit
