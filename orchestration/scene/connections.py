"""Who feeds whom in a scene. Connected variables have one unit; where an FMU declares none, any fits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..cosim.topology import Connection
from ..fmi.archive import Variable, similar
from ..fmi.units import same_unit
from .manipulator import DEFAULT_WIRING
from .members import Member
from .validation import Layer

__all__ = ["wired"]


def wired(members: Mapping[str, Member], given: tuple[Any, Layer] | None) -> tuple[Connection, ...]:
    """The connections given, or the default ones whose target no signal drives. members: by name. Raises SceneError."""
    if given is None:
        layer = Layer("default wiring", "", {})
        pairs = [(a, b) for a, b, acts in DEFAULT_WIRING if {a[0], b[0]} <= set(members) and acts(members)]
        found = [c for a, b in pairs for c in _connect(members, ".".join(a), ".".join(b), layer)]
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
        if not same_unit(a, b):
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
