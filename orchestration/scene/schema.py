"""Settings as frozen dataclasses. Each field declares default, unit, range and meaning once: files are checked against
it as against an FMU's variables, and the reference is written from it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, fields
from typing import Any, TypeVar

from ..fmi.archive import Variable, similar
from . import validation
from .validation import Layer

__all__ = ["declared", "setting", "settings"]

T = TypeVar("T")


def setting(
    default: Any,
    meaning: str,
    unit: str = "1",
    least: float = 0.0,
    most: float = float("inf"),
    choices: Sequence[str] = (),
) -> Any:
    """A field of such a dataclass. The type of the default is the setting's: float (in `unit`), int, or str out of
    `choices`."""
    kind = "Enumeration" if choices else {int: "Integer", float: "Real"}[type(default)]
    dimension = {unit: 1} if unit != "1" else {}
    about = Variable(
        "", 0, kind, "parameter", "fixed", meaning, unit, dimension, 1.0, least, most, default, items=tuple(choices)
    )
    return field(default=default, metadata={"about": about})


def declared(kind: type) -> dict[str, Variable]:
    """Of every field that is a setting: what was declared."""
    return {f.name: f.metadata["about"] for f in fields(kind) if "about" in f.metadata}


def settings(kind: type[T], tables: Iterable[tuple[Layer, Mapping[str, Any]]], prefix: str = "") -> T:
    """The dataclass with what the tables say, later ones winning. prefix: of the keys in messages. Raises
    SceneError."""
    known = declared(kind)
    found: dict[str, Any] = {}
    for layer, table in tables:
        for key, raw in table.items():
            if key not in known:
                layer.refuse(f"{prefix}{key}", raw, f"unknown; {similar(key, list(known))}")
            value = validation.scalar(layer, f"{prefix}{key}", raw, known[key])
            found[key] = known[key].items[int(value) - 1] if known[key].items else value
    return kind(**found)
