"""Placement of bodies in pictures: the table [placement] of a scene. It changes nothing that is computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..fmi.archive import Variable, similar
from . import validation
from .manipulator import SHAPE_OUTPUTS
from .member import Member
from .validation import Layer, flat

__all__ = ["Placement", "placements"]

_KEYS = ("position", "turn", "size", "motion")
_LENGTH = Variable("length", 0, "Real", "local", "fixed", "", "m", {"m": 1}, least=-1e3, most=1e3)
_SIZE = Variable("size", 0, "Real", "local", "fixed", "", "m", {"m": 1}, least=1e-6, most=1e3)
_ANGLE = Variable("angle", 0, "Real", "local", "fixed", "", "rad", {"rad": 1}, least=-100.0, most=100.0)


@dataclass(frozen=True)
class Placement:
    """Where a member stands in pictures, and what it is drawn as where it is not a rod.

    Attributes
    ----------
    position : tuple of float
        Of its origin, for a rod of its clamp: x, y, z [m].
    turn : float
        Angle of its axes about z [rad].
    size : tuple of float, optional
        Edges [m] of the block that it is drawn as, along its axes; centred in the position.
    motion : str, optional
        Output in m that moves the block: a scalar along its x axis, or three elements along its axes.
    """

    position: tuple[float, ...] = (0.0, 0.0, 0.0)
    turn: float = 0.0
    size: tuple[float, ...] | None = None
    motion: str | None = None


def placements(layers: Sequence[Layer], members: Mapping[str, Member]) -> dict[str, Placement]:
    """Read the tables [placement]: one for each member that stands somewhere. Raises SceneError."""
    given: dict[str, dict[str, Any]] = {}
    last: dict[str, Layer] = {}
    for layer in layers:
        table = layer.raw.get("placement", {})
        if not isinstance(table, Mapping):
            layer.refuse("placement", table, "give a table [placement] of member = { position = [x, y, z] }")
        for key, value in flat(table):
            member, _, name = key.rpartition(".")
            if member not in members:
                layer.refuse(f"placement.{key}", value, f"no FMU {member or name!r}; {similar(member, list(members))}")
            if name not in _KEYS:
                layer.refuse(f"placement.{key}", value, f"unknown; {similar(name, _KEYS)}")
            given.setdefault(member, {})[name] = _value(layer, f"placement.{key}", name, value, members[member])
            last[member] = layer
    for member, values in given.items():
        _require_a_shape(last[member], members[member], values)
    return {member: Placement(**values) for member, values in given.items()}


def _value(layer: Layer, key: str, name: str, value: Any, member: Member) -> Any:
    if name == "turn":
        return validation.number(layer, key, value, _ANGLE)
    if name == "motion":
        return _motion(layer, key, value, member)
    if not isinstance(value, list) or len(value) != 3:
        layer.refuse(key, value, "give three lengths, such as ['20 mm', 0, 0]")
    return tuple(validation.number(layer, key, item, _SIZE if name == "size" else _LENGTH) for item in value)


def _motion(layer: Layer, key: str, value: Any, member: Member) -> str:
    archive = member.archive
    elements = archive.vectors.get(value, ()) if isinstance(value, str) else ()
    names = (value,) if isinstance(value, str) and value in archive.variables else elements
    outputs = [name for name in names if archive.variables[name].causality == "output"]
    if len(outputs) not in (1, 3) or len(outputs) != len(names):
        known = [name for name, variable in archive.variables.items() if variable.causality == "output"]
        layer.refuse(key, value, f"not an output of one or three elements; {similar(str(value), known)}")
    return str(value)


def _require_a_shape(layer: Layer, member: Member, values: Mapping[str, Any]) -> None:
    """Refuse what cannot be drawn: a member that is neither a rod nor has a size, a rod with the size of a block."""
    is_rod = set(SHAPE_OUTPUTS) <= set(member.archive.vectors)
    key = f"placement.{member.name}"
    if is_rod and not {"size", "motion"}.isdisjoint(values):
        layer.refuse(key, None, "is a rod, whose shape is computed; give position and turn only")
    if not is_rod and "size" not in values:
        layer.refuse(key, None, "has no shape to draw; add size = ['16 mm', '16 mm', '12 mm']")
