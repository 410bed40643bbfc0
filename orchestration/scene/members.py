"""The FMUs of a scene: which, and what is set in each; every name and value checked against the FMU's own XML."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..cosim.signals import Signal
from ..fmi.archive import Archive, find_fmu, similar
from . import validation
from .manipulator import DEFAULT_FMUS
from .validation import Layer

__all__ = ["Member", "read_members"]

Value = float | int | bool | str


@dataclass(frozen=True)
class Member:
    """One FMU of a scene: what is set once, and what drives its inputs. frozen: a co-simulation takes no step of it, so
    that its outputs stay as they are at the start (resting.py); no key of a scene, but chosen where it changes
    nothing."""

    name: str
    archive: Archive
    parameters: Mapping[str, Value]
    signals: Mapping[str, Signal]
    frozen: bool = False

    def value(self, parameter: str) -> Value | None:
        """The value that holds, set or start; None where there is no such parameter."""
        declared = self.archive.variables.get(parameter)
        return self.parameters.get(parameter, declared.start if declared else None)

    def real(self, parameter: str) -> float:
        """Of one that there is."""
        return float(self.value(parameter) or 0.0)

    def reals(self, vector: str) -> tuple[float, ...]:
        return tuple(self.real(element) for element in self.archive.vectors[vector])

    def choice(self, parameter: str) -> str:
        """The item of an enumeration that holds."""
        return self.archive.variables[parameter].item_name(self.real(parameter))


def read_members(
    top: Mapping[str, tuple[Any, Layer]],
    layers: Sequence[Layer],
    keys: Sequence[str],
    folder: Path,
    archive: Callable[[Path], Archive],
) -> tuple[Member, ...]:
    """top: what holds under each key at the top of a scene, keys: which there may be beside names of FMUs. Raises
    SceneError."""
    given = [layer.raw["fmus"] for layer in layers if "fmus" in layer.raw]
    where = top["fmus"][1] if given else layers[-1]
    for table in given:
        if not isinstance(table, Mapping) or not table:
            where.refuse("fmus", table, "wants a table of name = 'file.fmu'")
    in_file = [layer for layer in layers if "fmus" in layer.raw and layer.numbered]
    files = {name: file for table in [*([] if in_file else [DEFAULT_FMUS]), *given] for name, file in table.items()}
    for name, file in files.items():
        if not isinstance(file, str):
            where.refuse(f"fmus.{name}", file, "wrong type; give a file name such as 'rod.fmu'")
    for layer in layers:
        for key, value in layer.raw.items():
            if key in files and not isinstance(value, Mapping):
                layer.refuse(key, value, f"wants a table [{key}]")
            if key not in files and key not in keys:
                layer.refuse(
                    key,
                    None,
                    f"unknown {'section' if isinstance(value, Mapping) else 'key'}; {similar(key, (*keys, *files))}",
                )
    return tuple(_member(name, archive(find_fmu(file, folder)), layers) for name, file in files.items())


def _member(name: str, archive: Archive, layers: Sequence[Layer]) -> Member:
    parameters: dict[str, Value] = {}
    signals: dict[str, Signal] = {}
    for layer in layers:
        for key, raw in _flat(layer.raw.get(name, {})):
            for full, element in _elements(layer, name, key, raw, archive):
                variable, place = archive.variables[full], f"{name}.{full}"
                if variable.causality == "input" and variable.type == "Real":
                    signals[full] = validation.signal(layer, place, element, variable)
                elif variable.causality in ("parameter", "input"):  # inputs that are not Real are constant
                    parameters[full] = validation.scalar(layer, place, element, variable)
                else:
                    layer.refuse(place, element, f"is {variable.causality}; only parameters and inputs can be set")
    return Member(name, archive, parameters, signals)


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names of nested tables; a table that is a signal stays whole."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not any(kind in value for kind in validation.SIGNALS):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _elements(layer: Layer, member: str, key: str, raw: Any, archive: Archive) -> list[tuple[str, Any]]:
    """The scalar variables that a key stands for, each with its raw value."""
    if key in archive.variables:
        return [(key, raw)]
    elements = archive.vectors.get(key)
    if elements is None:
        layer.refuse(
            f"{member}.{key}",
            raw,
            f"no such variable in {archive.path.name}; {similar(key, [*archive.variables, *archive.vectors])}",
        )
    if not isinstance(raw, list):
        return [(element, raw) for element in elements]
    if len(raw) != len(elements):
        layer.refuse(
            f"{member}.{key}", raw, f"{len(raw)} values for {len(elements)} elements of {key}; give {len(elements)}"
        )
    return list(zip(elements, raw, strict=True))
