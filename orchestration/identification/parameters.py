"""Free parameters: which values of a scene are estimated, within which bounds, with which prior knowledge."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import SceneError
from ..fmi.archive import similar
from ..scene import Member, Scene
from ..scene.columns import repeated

__all__ = ["FreeParameter", "read_free"]

_LENGTH = "body.length"  # the sum of its segments
_BODY, _SEGMENT = "body.", "segment."  # a parameter of the body is that of all its segments


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that is estimated.

    Attributes
    ----------
    name : str
        'member.parameter'; of a vector one value for all elements.
    start : float
        Where the search starts, in the parameter's own unit.
    least, most : float
        Bounds.
    unit : str
    prior : tuple of float, optional
        Mean and standard deviation of what is known before.
    """

    name: str
    start: float
    least: float
    most: float
    unit: str
    prior: tuple[float, float] | None = None

    @property
    def scale(self) -> float:
        """Size of the parameter, by which the search scales it."""
        return abs(self.start) or (self.prior[1] if self.prior else max(abs(self.least), abs(self.most)))


def read_free(scene: Scene, texts: Sequence[str]) -> tuple[FreeParameter, ...]:
    """Read free parameters: NAME, NAME=LOW:HIGH for bounds, NAME~MEAN:DEVIATION for a prior, or all of it.

    Raises
    ------
    SceneError
        The message names the text, what is allowed and the remedy.
    """
    if not texts:
        raise SceneError("nothing is free; name parameters to estimate, such as thermal.tca.R")
    free = tuple(_read(scene, text) for text in texts)
    names = [p.name for p in free]
    twice = repeated(names)
    if twice is not None:
        raise SceneError(f"--free {twice}: it is named twice; name it once")
    owners: dict[str, str] = {}
    for name in names:
        for element in _elements(scene, name):
            other = owners.setdefault(element, name)
            if other != name:
                raise SceneError(f"--free {other} and {name}: both set {element}; free one of them")
    return free


def _read(scene: Scene, text: str) -> FreeParameter:
    rest, _, known = text.partition("~")
    name, _, bounds = rest.strip().partition("=")
    member, _, parameter = name.strip().partition(".")
    owner = next((m for m in scene.members if m.name == member), None)
    if owner is None:
        raise SceneError(f"--free {text}: no FMU {member!r}; the scene has {', '.join(m.name for m in scene.members)}")
    archive = owner.archive
    elements = archive.vectors.get(parameter, (parameter,))
    reals = [v.name for v in archive.variables.values() if v.causality == "parameter" and v.type == "Real"]
    if elements[0] not in reals:
        remedy = similar(parameter, [*(b for b, e in archive.vectors.items() if e[0] in reals), *reals])
        raise SceneError(f"--free {text}: {parameter!r} is not a real parameter; {remedy}")
    variable = archive.variables[elements[0]]
    start = _common_value(text, owner, parameter, elements)
    least, most = _pair(text, bounds, "low:high") if bounds else (variable.least, variable.most)
    prior = _pair(text, known, "mean:deviation") if known else None
    if not least < most:
        raise SceneError(f"--free {text}: the lower bound is not below the upper one; give NAME=LOW:HIGH")
    least, most = max(least, variable.least), min(most, variable.most)
    if not least < most:
        raise SceneError(
            f"--free {text}: no value in these bounds is allowed; allowed: {variable.least:g} to {variable.most:g} "
            f"{variable.unit}"
        )
    if prior is not None and not (math.isfinite(prior[0]) and 0.0 < prior[1] < math.inf):
        raise SceneError(f"--free {text}: a standard deviation is positive; give NAME~MEAN:DEVIATION")
    if start == 0.0 and not (prior or (bounds and math.isfinite(least) and math.isfinite(most))):
        raise SceneError(
            f"--free {text}: it starts at 0, which does not tell its size; give bounds, NAME=LOW:HIGH, or a prior, "
            f"NAME~MEAN:DEVIATION, or start elsewhere, --set '{name.strip()}=...'"
        )
    inside = min(max(start, least), most)
    return FreeParameter(name.strip(), inside, least, most, variable.unit, prior)


def _elements(scene: Scene, name: str) -> list[str]:
    """Return the variables that a free parameter sets: those of a vector, and for the body's those of its segments."""
    member, _, parameter = name.partition(".")
    archive = scene.member(member).archive
    elements = list(archive.vectors.get(parameter, (parameter,)))
    if parameter.startswith(_BODY):
        of_segments = f"{_SEGMENT}{parameter.removeprefix(_BODY)}["
        elements += [v for v in archive.variables if v.startswith(of_segments)]
    return [f"{member}.{element}" for element in elements]


def _common_value(text: str, member: Member, parameter: str, elements: Sequence[str]) -> float:
    """Return the value that all elements have. Raises SceneError where one value cannot stand for them."""
    values = [member.real(element) for element in elements]
    if len(set(values)) > 1:
        names = " ".join(f"{member.name}.{element}" for element in elements)
        raise SceneError(f"--free {text}: its elements differ in the scene; free them one by one: {names}")
    of_segments = f"{_SEGMENT}{parameter.removeprefix(_BODY)}["
    own = sorted(key for key in member.parameters if parameter.startswith(_BODY) and key.startswith(of_segments))
    common = member.real(own[0]) if own and parameter == _LENGTH else values[0]
    if any(member.real(key) != common for key in own):
        raise SceneError(
            f"--free {text}: the scene gives segments values of their own; free those: "
            + " ".join(f"{member.name}.{key}" for key in own)
        )
    return values[0]


def _pair(text: str, pair: str, form: str) -> tuple[float, float]:
    try:
        one, other = (float(part) for part in pair.split(":"))
    except ValueError as error:
        raise SceneError(f"--free {text}: {pair.strip()!r} is not {form}; give two numbers") from error
    return one, other
