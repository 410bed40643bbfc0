"""A parameter of a sweep: a distribution of scipy.stats with units, or a list of values.

    "thermal.h"   = { uniform = { loc = "15 W/(m2.K)", scale = "10 W/(m2.K)" } }
    "rod.body.E"  = { lognorm = { s = 0.1, scale = "37.8 kPa" }, levels = 5 }       levels: of a grid
    "rod.strains" = ["bending", "extensible"]
    "thermal.tca.offset, rod.tca.offset" = ["2.4 mm", "2.6 mm"]                     one value for both

loc and scale are in the parameter's unit, shapes are pure numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import stats

from ...fmi.archive import Variable, similar
from ...scene import Coupling, Scene, validation
from ...scene.schema import declared
from ...scene.validation import Layer

__all__ = ["Parameter", "read_parameter"]

_SHAPE = Variable("shape", 0, "Real", "local", "fixed", "", "1", {})
_LEVELS = Variable("levels", 0, "Integer", "local", "fixed", "", "1", {}, least=1, most=10_000)


@dataclass(frozen=True)
class Parameter:
    """A varied parameter: a list of values or a distribution.

    Parameters
    ----------
    name : str
        Keys of a scene that share one value, separated by commas.
    variable : Variable
        Type, unit and range of the first of them.
    values : tuple
        Values of a list, as a scene takes them; empty for a distribution.
    law : str
        Name of a distribution in scipy.stats; empty for a list.
    arguments : tuple of (str, float)
        Arguments of the distribution.
    levels : int
        Number of its values in a grid.
    """

    name: str
    variable: Variable
    values: tuple[float | int | bool | str, ...] = ()
    law: str = ""
    arguments: tuple[tuple[str, float], ...] = ()
    levels: int = 0

    @property
    def cells(self) -> int:
        """Number of its cells in a grid."""
        return len(self.values) or self.levels

    def value_at(self, u: float) -> float | int | bool | str:
        """Value at the share u, in [0, 1), of the distribution or of the list."""
        if self.values:
            return self.values[min(int(u * len(self.values)), len(self.values) - 1)]
        value = float(self.distribution.ppf(u))
        return round(value) if self.variable.type == "Integer" else value

    @cached_property
    def distribution(self) -> Any:
        """The distribution of scipy.stats with its arguments."""
        return getattr(stats, self.law)(**dict(self.arguments))

    def settings(self, value: float | int | bool | str) -> list[str]:
        """Overrides of a scene that set the value, exact to the last bit."""
        text = str(value).lower() if isinstance(value, bool) else str(value)
        return [f"{name}={text}" for name in _names(self.name)]


def read_parameter(layer: Layer, scene: Scene, name: str, raw: Any) -> Parameter:
    """Read one entry of the table `parameters`. Raises SceneError, which names what is allowed."""
    key = f"parameters.{name}"
    variable, *others = [_variable(layer, scene, one, key) for one in _names(name)]
    for other in others:
        if (other.type, other.unit, other.items) != (variable.type, variable.unit, variable.items):
            layer.refuse(key, None, "parameters of one value want one type and unit; give each its own line")
    if isinstance(raw, list):
        if not raw:
            layer.refuse(key, raw, "an empty list; give values, or a distribution")
        values = [validation.scalar(layer, key, value, variable) for value in raw]
        return Parameter(name, variable, tuple(variable.item_name(float(v)) if variable.items else v for v in values))
    if not isinstance(raw, Mapping):
        layer.refuse(key, raw, "wants a list of values or a distribution, such as { uniform = { loc = 1, scale = 2 } }")
    laws = [word for word in raw if word != "levels"]
    if len(laws) != 1:
        layer.refuse(key, dict(raw), "wants one distribution, such as { uniform = { loc = 1, scale = 2 } }")
    arguments = _arguments(layer, key, laws[0], raw[laws[0]], variable)
    levels = int(validation.scalar(layer, f"{key}: levels", raw["levels"], _LEVELS)) if "levels" in raw else 0
    return Parameter(name, variable, law=laws[0], arguments=arguments, levels=levels)


def _names(name: str) -> list[str]:
    return [one.strip() for one in name.split(",")]


def _variable(layer: Layer, scene: Scene, name: str, key: str) -> Variable:
    """Declaration of a parameter; of its first element where a vector is set as a whole."""
    member, _, rest = name.partition(".")
    if member == "coupling":
        known = declared(Coupling)
        if rest not in known:
            layer.refuse(key, None, f"no such setting; {similar(rest, list(known))}")
        return known[rest]
    members = {m.name: m.archive for m in scene.members}
    if member not in members:
        layer.refuse(key, None, f"no FMU {member!r} in scene {scene.name}; {similar(member, [*members, 'coupling'])}")
    archive = members[member]
    settable = {n: v for n, v in archive.variables.items() if v.causality in ("parameter", "input")}
    settable |= {base: settable[names[0]] for base, names in archive.vectors.items() if names[0] in settable}
    if rest not in settable:
        layer.refuse(key, None, f"no parameter or input of {archive.path.name}; {similar(rest, list(settable))}")
    return settable[rest]


def _arguments(layer: Layer, key: str, law: str, raw: Any, variable: Variable) -> tuple[tuple[str, float], ...]:
    discrete = isinstance(getattr(stats, law, None), stats.rv_discrete)
    if not discrete and not isinstance(getattr(stats, law, None), stats.rv_continuous):
        known = [n for n in dir(stats) if isinstance(getattr(stats, n), (stats.rv_continuous, stats.rv_discrete))]
        layer.refuse(key, law, f"no distribution of scipy.stats; {similar(law, known)}")
    if variable.type not in ("Real", "Integer"):
        layer.refuse(key, law, f"{variable.type} variables take a list of values, such as {list(variable.items[:2])}")
    if variable.type == "Integer" and not discrete:
        layer.refuse(key, law, "whole numbers want a list or a discrete distribution, such as randint")
    if not isinstance(raw, Mapping):
        layer.refuse(key, raw, f"{law} wants a table of its arguments")
    kind = getattr(stats, law)
    shapes = [shape.strip() for shape in kind.shapes.split(",")] if kind.shapes else []
    allowed = [*shapes, "loc"] if discrete else [*shapes, "loc", "scale"]
    arguments = {}
    for name, value in raw.items():
        where = f"{key}: {law}.{name}"
        if name not in allowed:
            layer.refuse(where, value, f"unknown; {similar(name, allowed)}")
        if name in shapes:
            arguments[name] = validation.number(layer, where, value, _SHAPE)
        else:
            arguments[name] = validation.number(layer, where, value, variable, difference=name == "scale")
    if missing := [shape for shape in shapes if shape not in arguments]:
        layer.refuse(key, dict(raw), f"{law} wants {', '.join(missing)} as well")
    if not np.isfinite(kind(**arguments).ppf(0.5)):
        layer.refuse(key, dict(raw), f"arguments that {law} does not allow")
    return tuple(arguments.items())
