"""An FMU of a scene with the values set in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..cosim.signals import Signal
from ..errors import SceneError
from ..fmi.archive import Archive
from .manipulator import set_by

__all__ = ["Member", "Value", "set_parameter", "settable"]

Value = float | int | bool | str


@dataclass(frozen=True)
class Member:
    """An FMU of a scene: its parameters, and the signals that drive its inputs.

    frozen: a co-simulation takes no step of it, so that its outputs stay as they are at the start
    (cosim/frozen_subsystem.py); not a key of scenes, but set where model selection finds that it changes nothing.
    recorded: names of variables that a result shows beside inputs and outputs.
    """

    name: str
    archive: Archive
    parameters: Mapping[str, Value]
    signals: Mapping[str, Signal]
    frozen: bool = False
    recorded: frozenset[str] = frozenset()

    def value(self, parameter: str) -> Value | None:
        """Value of a parameter, set or start; None where there is no such parameter."""
        declared = self.archive.variables.get(parameter)
        return self.parameters.get(parameter, declared.start if declared else None)

    def real(self, parameter: str) -> float:
        """Value of a parameter that must exist."""
        return float(self.value(parameter) or 0.0)

    def reals(self, vector: str) -> tuple[float, ...]:
        """Values of a vector's elements. Raises SceneError where the FMU has no such vector."""
        if vector not in self.archive.vectors:
            raise SceneError(f"{self.name}: {self.archive.path.name} has no vector {vector!r}; give an FMU that has it")
        return tuple(self.real(element) for element in self.archive.vectors[vector])

    def each(self, parameter: str, count: int) -> tuple[float, ...]:
        """Values of a parameter for `count` TCAs: those of a vector, or those of a scalar that holds for all."""
        return self.reals(parameter) if parameter in self.archive.vectors else (self.real(parameter),) * count

    def has(self, parameter: str) -> bool:
        """Whether the FMU has a parameter."""
        return parameter in self.archive.variables

    def acts(self, parameter: str) -> bool:
        """Whether a parameter, or an element of a vector, is there and not 0."""
        return any(self.value(name) not in (None, 0) for name in self.archive.vectors.get(parameter, (parameter,)))

    def with_values(self, values: Mapping[str, Value]) -> Member:
        """Return the member with parameters set after those that it has."""
        parameters = dict(self.parameters)
        for name, value in values.items():
            set_parameter(parameters, name, value, self.archive)
        return replace(self, parameters=parameters)

    def choice(self, parameter: str) -> str:
        """Name of the item that an enumeration has."""
        return self.archive.variables[parameter].item_name(self.real(parameter))


def set_parameter(parameters: dict[str, Value], name: str, value: Value, archive: Archive) -> None:
    """Set a parameter after those that are there, which are set in their order.

    What an FMU of this package sets with it is noted too, so that whoever reads the parameters sees those that the FMU
    has.
    """
    parameters.pop(name, None)
    parameters[name] = value
    if not archive.reentrant or archive.variables[name].causality != "parameter":
        return
    others, share = set_by(name, archive.vectors)
    for other in others:
        parameters.pop(other, None)
        parameters[other] = value if share == 1.0 else share * float(value)


def settable(archive: Archive) -> list[str]:
    """Names of what a scene can set in an FMU: vectors, and scalars that are not elements of one."""
    names = {v.name for v in archive.variables.values() if v.causality in ("parameter", "input")}
    elements = {element for vector in archive.vectors.values() for element in vector}
    return [base for base, vector in archive.vectors.items() if vector[0] in names] + sorted(names - elements)
