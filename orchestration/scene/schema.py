"""Settings as frozen dataclasses, read from tables of a scene.

Each field declares default, unit, range and meaning once: files are checked against it as against an FMU's variables,
and the reference is written from it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import Field, fields
from typing import Any, TypeVar

from ..cosim.settings import Declaration, setting
from ..fmi.archive import Variable, similar
from . import validation
from .validation import Layer

__all__ = ["declared", "setting", "settings"]

T = TypeVar("T")


def _variable(f: Field[Any]) -> Variable:
    """Describe a setting as a parameter of an FMU is described, so that values of both are checked alike."""
    d: Declaration = f.metadata["declaration"]
    default: Any = f.default
    kind = "Enumeration" if d.choices else {int: "Integer", float: "Real"}[type(default)]
    numerator, _, denominator = d.unit.partition("/")
    dimension = {unit: power for unit, power in ((numerator, 1), (denominator, -1)) if unit not in ("", "1")}
    return Variable(
        name="",
        reference=0,
        type=kind,
        causality="parameter",
        variability="fixed",
        description=d.meaning,
        unit=d.unit,
        dimension=dimension,
        least=d.least,
        most=d.most,
        start=default,
        items=d.choices,
    )


def declared(kind: type) -> dict[str, Variable]:
    """Return the declarations of a dataclass of settings, by field."""
    return {f.name: _variable(f) for f in fields(kind) if "declaration" in f.metadata}


def settings(kind: type[T], tables: Iterable[tuple[Layer, Mapping[str, Any]]], prefix: str = "") -> T:
    """Return the dataclass with the values of the tables; later ones win.

    prefix: of the keys in messages. Raises SceneError.
    """
    known = declared(kind)
    values: dict[str, Any] = {}
    for layer, table in tables:
        for key, raw in table.items():
            if key not in known:
                layer.refuse(f"{prefix}{key}", raw, f"unknown; {similar(key, list(known))}")
            value = validation.scalar(layer, f"{prefix}{key}", raw, known[key])
            values[key] = known[key].item_name(float(value)) if known[key].items else value
    return kind(**values)
