"""Tables [body] and [tca] of a scene: parameters of the manipulator that its FMUs share, given once.

Both FMUs have the geometry as parameters of their own. A value of these tables goes to every FMU that has the
parameter; in connected thermal and rod FMUs the shared parameters must agree, however they are given."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..cosim.topology import Connection
from ..errors import SceneError
from ..fmi.archive import Archive, similar
from .manipulator import ROD, SHARED_PARAMETERS, STIFFNESS, THERMAL, RodParameters
from .member import Member, settable
from .validation import Layer, flat

__all__ = ["SHARED_TABLES", "check_profile", "check_shared", "distribute"]

SHARED_TABLES = ("body", "tca")
_SAME = 1e-12  # relative difference of values that are the same, given in different units


def distribute(layers: Sequence[Layer], archives: Mapping[str, Archive]) -> list[Layer]:
    """Hand the values of [body] and [tca] on to the FMUs.

    archives: by member. Within a layer a value of an FMU's own table wins. Raises SceneError for a key that no FMU
    has."""
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
            layer.refuse(
                key, value, f"no FMU has it; {similar(key, [k for k in known if k.startswith(SHARED_TABLES)])}"
            )
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
    pairs = {tuple(sorted((c.source[0], c.target[0]))) for c in connections if c.source[0] != c.target[0]}
    for a, b in sorted(pairs):
        if {a, b} <= models.keys():
            _agree(models[a], models[b])


def check_profile(members: Sequence[Member]) -> None:
    """Raise SceneError where a rod of a given profile does not have all its stiffnesses: the FMU's start values of
    them describe no body."""
    for member in members:
        if member.archive.description.model_name != ROD or member.value("body.profile") is None:
            continue
        missing = [name for name in member.archive.vectors.get(STIFFNESS, ()) if name not in member.parameters]
        if missing and RodParameters.of(member).profile == "given":
            raise SceneError(
                f"{member.name}.body.profile = 'given', but {', '.join(missing)} not set: give all six of "
                f"{member.name}.{STIFFNESS} [N.m2, N.m2, N.m2, N, N, N], or set {member.name}.body.profile = 'round'"
            )


def _is_own_of_sections(parameter: str, a: Member, b: Member) -> bool:
    """Whether the parameter of one section of the body says nothing about the other: a section of a serial body, or the
    radius where the body tapers."""
    if any("segment.length[2]" in member.archive.variables for member in (a, b)):
        return True
    tapers = any(name.startswith("segment.radius") for member in (a, b) for name in member.parameters)
    return tapers and parameter == "body.radius"


def _agree(a: Member, b: Member) -> None:
    for parameter in SHARED_PARAMETERS:
        if _is_own_of_sections(parameter, a, b):
            continue
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


def _quoted(name: str) -> str:
    return f"'{name}'" if "[" in name else name
