"""The accuracy that a scene asks for: quantities, tolerance, and whether the models are given or selected for that."""

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

    level: str = setting("given", "given: use the scene's models; auto: select them", choices=("given", "auto"))
    tolerance: float = setting(1e-3, "rms error of the quantities over the run, share of their range", "1", 1e-6, 0.3)
    search: str = setting(
        "once", "once: reuse what an earlier search for the same scene chose; anew: search", choices=("once", "anew")
    )
    quantities: tuple[str, ...] = ()  # empty: the tip's position


def read(layers: Sequence[Layer], archives: Mapping[str, Archive]) -> AccuracyRequest:
    """Read the tables [fidelity]; archives: by member. Raises SceneError."""
    tables: list[tuple[Layer, Mapping[str, Any]]] = []
    quantities: tuple[str, ...] = ()
    for layer in layers:
        table = layer.raw.get("fidelity", {})
        if not isinstance(table, Mapping):
            layer.refuse("fidelity", table, "give a table [fidelity]")
        tables.append((layer, {key: value for key, value in table.items() if key != "quantities"}))
        if "quantities" in table:
            quantities = _quantities(layer, table["quantities"], archives)
    return replace(settings(AccuracyRequest, tables, "fidelity."), quantities=quantities)


def _quantities(layer: Layer, raw: object, archives: Mapping[str, Archive]) -> tuple[str, ...]:
    key = "fidelity.quantities"
    if not isinstance(raw, list) or not raw or not all(isinstance(name, str) for name in raw):
        layer.refuse(key, raw, "give a list of outputs, such as ['rod.tip.p']")
    outputs = [
        f"{member}.{name}"
        for member, archive in archives.items()
        for name, elements in [*archive.vectors.items(), *((name, (name,)) for name in archive.variables)]
        if archive.variables[elements[0]].causality == "output" and archive.variables[elements[0]].type == "Real"
    ]
    for name in raw:
        if name not in outputs:
            known = [output for output in outputs if not output.endswith("]")]
            layer.refuse(key, name, f"is not a Real output; {similar(name, known)}")
        if name.endswith("]"):
            layer.refuse(key, name, f"give the whole vector, {name[: name.rindex('[')]!r}")
    return tuple(raw)
