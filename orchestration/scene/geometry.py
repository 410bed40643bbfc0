"""Tables [body] and [tca] of a scene: parameters of the manipulator that its FMUs share, given once.

Both FMUs have the geometry as parameters of their own. A value of these tables goes to every FMU that has the
parameter; in connected thermal and rod FMUs the shared parameters must agree, however they are given.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..cosim.topology import Connection
from ..errors import SceneError
from ..fmi.archive import Archive, similar
from .body import RodParameters
from .manipulator import (
    ROD,
    SHARED_PARAMETERS,
    STIFFNESS,
    THERMAL,
    Geometry,
)
from .member import Member, settable
from .sizes import SIZE_KEYS
from .validation import Layer, flat

__all__ = ["SHARED_TABLES", "check_profile", "check_shared", "distribute"]

SHARED_TABLES = ("body", "tca")
_ELEMENT = re.compile(r"(?:T|delta)\[(\d+)\]")  # what thermal FMU and rod exchange about one TCA
_SAME = 1e-12  # relative difference of values that are the same, given in different units


def distribute(layers: Sequence[Layer], archives: Mapping[str, Archive]) -> list[Layer]:
    """Hand the values of [body] and [tca] on to the FMUs.

    archives: by member. Within a layer a value of an FMU's own table wins. Raises SceneError for a key that no FMU
    has.
    """
    return [_distributed(layer, archives) for layer in layers]


def _distributed(layer: Layer, archives: Mapping[str, Archive]) -> Layer:
    shared = [(key, value) for table in SHARED_TABLES if table not in archives for key, value in _table(layer, table)]
    if not shared:
        return layer
    raw = {key: value for key, value in layer.raw.items() if key in archives or key not in SHARED_TABLES}
    handed: dict[str, dict[str, Any]] = {}
    for key, value in shared:
        base = key.partition("[")[0]
        owners = [name for name, archive in archives.items() if {key, base} & {*archive.variables, *archive.vectors}]
        if not owners:
            known = {name for archive in archives.values() for name in settable(archive)}
            known = {name for name in known if name.startswith(SHARED_TABLES)} | set(SIZE_KEYS)
            layer.refuse(key, value, f"no FMU has it; {similar(key, known)}")
        for owner in owners:
            handed.setdefault(owner, {})[key] = value
    for owner, values in handed.items():
        own = raw.get(owner, {})
        if isinstance(own, Mapping):  # what is not a table is refused when it is read
            names = {name for name, _ in flat(own)}
            raw[owner] = {**{key: value for key, value in values.items() if key not in names}, **own}
    return replace(layer, raw=raw)


def _table(layer: Layer, table: str) -> Iterator[tuple[str, Any]]:
    if table not in layer.raw:
        return
    content = layer.raw[table]
    if not isinstance(content, Mapping):
        layer.refuse(table, content, f"give a table [{table}]")
    yield from flat(content, f"{table}.")


def check_shared(members: Sequence[Member], connections: Sequence[Connection]) -> None:
    """Raise SceneError where a thermal and a rod FMU that are connected have different shared parameters."""
    models = {member.name: member for member in members if member.archive.description.model_name in (THERMAL, ROD)}
    pairs: dict[tuple[str, ...], list[Connection]] = {}
    for c in connections:
        if c.source[0] != c.target[0]:
            pairs.setdefault(tuple(sorted((c.source[0], c.target[0]))), []).append(c)
    for a, b in sorted(pairs):
        if {a, b} <= models.keys():
            _agree(models[a], models[b], pairs[a, b])


def check_profile(members: Sequence[Member]) -> None:
    """Raise SceneError where a rod of a given profile does not have all its stiffnesses.

    The FMU's start values of them describe no body.
    """
    for member in members:
        if member.archive.description.model_name != ROD or member.value("body.profile") is None:
            continue
        missing = [name for name in member.archive.vectors.get(STIFFNESS, ()) if name not in member.parameters]
        if missing and RodParameters.of(member).profile == "given":
            raise SceneError(
                f"{member.name}.body.profile = 'given', but {', '.join(missing)} not set: give all six of "
                f"{member.name}.{STIFFNESS} [N.m2, N.m2, N.m2, N, N, N], or set {member.name}.body.profile = 'round'"
            )


def _agree(a: Member, b: Member, wires: Sequence[Connection]) -> None:
    rod = next((member for member in (a, b) if member.archive.description.model_name == ROD), None)
    heat = b if rod is a else a
    if rod is None or heat.archive.description.model_name != THERMAL:
        return
    body = RodParameters.of(rod)
    if len(body.segments) == 1 and not body.segments[0].is_tapered:
        _same_parameters(a, b)
    else:
        for wire in wires:
            _fits_in(heat, rod, body, wire)


def _same_parameters(a: Member, b: Member) -> None:
    for parameter in SHARED_PARAMETERS:
        for name in {**dict.fromkeys(x for m in (a, b) for x in m.archive.vectors.get(parameter, ()))} or (parameter,):
            one, other = (m.value(name if name in m.archive.variables else parameter) for m in (a, b))
            if not isinstance(one, float) or not isinstance(other, float):
                continue
            if abs(one - other) > _SAME * max(abs(one), abs(other)):
                unit = a.archive.variables[name].unit
                raise SceneError(
                    f"{a.name}.{name} = {one:g} {unit}, but {b.name}.{name} = {other:g} {unit}: connected FMUs "
                    f"describe one manipulator; set {name} once for both, in the table [{name.partition('.')[0]}] or "
                    f"as --set {_quoted(name)}='{one:g} {unit}'"
                )


def _fits_in(heat: Member, rod: Member, body: RodParameters, wire: Connection) -> None:
    """Compare the section of a thermal FMU with the part of the body along which a TCA lies that gets its temperature.

    Radius and distances must occur there. The length must be that of the part, or where the TCA takes the mean of
    several sections no longer than it; the azimuth that of a TCA that is not wound about the axis.
    """
    own, theirs = (wire.source, wire.target) if wire.source[0] == heat.name else (wire.target, wire.source)
    indices = [_ELEMENT.fullmatch(name) for _, name in (own, theirs)]
    if None in indices:
        return
    k, i = (int(index[1]) - 1 for index in indices if index)
    section, tca = Geometry.of(heat), body.tcas[i]
    part = body.segments[tca.first_segment - 1 : tca.last_segment]
    if not part:
        raise SceneError(
            f"{rod.name}.tca.first_segment[{i + 1}] = {tca.first_segment}, but {rod.name}.tca.last_segment[{i + 1}] = "
            f"{tca.last_segment}: no span of a body of {len(body.segments)} segments; set first <= last"
        )
    radii = [radius for segment in part for radius in (segment.radius, segment.radius_end)]
    start, end = body.span(i)
    offsets = (tca.offset, tca.offset_end)
    checks: list[tuple[str, float, float, float]] = [
        ("body.radius", section.radius, min(radii), max(radii)),
        ("body.length", section.length, end - start if wire.terms == 1 else 0.0, end - start),
        (f"tca.offset[{k + 1}]", section.offset[k], min(offsets), max(offsets)),
    ]
    if tca.helix == 0.0:
        checks.append((f"tca.azimuth[{k + 1}]", section.azimuth[k], tca.azimuth, tca.azimuth))
    for name, value, least, most in checks:
        margin = _SAME * max(abs(least), abs(most))
        if least - margin <= value <= most + margin:
            continue
        unit = heat.archive.variables[name if name in heat.archive.variables else name.partition("[")[0]].unit
        allowed = f"{least:g} {unit}" if least == most else f"{least:g} to {most:g} {unit}"
        raise SceneError(
            f"{heat.name}.{name} = {value:g} {unit}, but TCA {i + 1} of {rod.name}, which takes its temperature, lies "
            f"in a part of the body with {allowed}; set {heat.name}.{name} to that, or change the body"
        )


def _quoted(name: str) -> str:
    return f"'{name}'" if "[" in name else name
