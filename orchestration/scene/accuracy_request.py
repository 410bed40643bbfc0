"""What a scene asks for: which quantities, how exactly, and whether the models are as given or chosen for that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..fmi.archive import Archive, similar
from .schema import setting, settings
from .validation import Layer

__all__ = ["AccuracyRequest", "read"]


@dataclass(frozen=True)
class AccuracyRequest:
    """The table [fidelity] of a scene; beside the settings it has quantities, a list of outputs such as 'rod.tip.p'."""

    level: str = setting("given", "models as the scene sets them, or no more than it needs", choices=("given", "auto"))
    tolerance: float = setting(1e-3, "rms error of the quantities over the run, share of their range", "1", 1e-6, 0.3)
    quantities: tuple[str, ...] = ()  # empty: the tip's position


def read(layers: Sequence[Layer], archives: Mapping[str, Archive]) -> AccuracyRequest:
    """From the tables [fidelity]. archives: per member name. Raises SceneError."""
    tables: list[tuple[Layer, Mapping[str, Any]]] = []
    quantities: tuple[str, ...] = ()
    for layer in layers:
        table = layer.raw.get("fidelity", {})
        if not isinstance(table, Mapping):
            layer.refuse("fidelity", table, "wants a table [fidelity]")
        tables.append((layer, {key: value for key, value in table.items() if key != "quantities"}))
        if "quantities" in table:
            quantities = _quantities(layer, table["quantities"], archives)
    return replace(settings(AccuracyRequest, tables, "fidelity."), quantities=quantities)


def _quantities(layer: Layer, raw: object, archives: Mapping[str, Archive]) -> tuple[str, ...]:
    key = "fidelity.quantities"
    if not isinstance(raw, list) or not raw or not all(isinstance(name, str) for name in raw):
        layer.refuse(key, raw, "wants a list of outputs, such as ['rod.tip.p']")
    outputs = [
        f"{member}.{name}"
        for member, archive in archives.items()
        for name, elements in [*archive.vectors.items(), *((name, (name,)) for name in archive.variables)]
        if archive.variables[elements[0]].causality == "output" and archive.variables[elements[0]].type == "Real"
    ]
    for name in raw:
        if name not in outputs:
            layer.refuse(key, name, f"no Real output; {similar(name, [o for o in outputs if not o.endswith(']')])}")
        if name.endswith("]"):
            layer.refuse(key, name, f"give the whole vector, {name[: name.rindex('[')]!r}")
    return tuple(raw)
