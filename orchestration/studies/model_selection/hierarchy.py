"""What can be chosen, as data: one ladder per axis, from the least model to the most. A choice is one rung on each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ...fmi.archive import kept
from ...scene import Member, Scene
from ...scene.loop_closure import closed_inside
from ...scene.manipulator import ROD, THERMAL
from .dimensionless_numbers import unheated
from .symmetry import plane

__all__ = ["REST", "Axis", "Choice", "Ladder", "applied", "ladder", "settings"]

REST = "frozen"  # the one key here that is no parameter of an FMU: of a member that is never stepped
Value = float | int | bool | str
Choice = Mapping[str, int]  # axis -> rung


@dataclass(frozen=True)
class Axis:
    """rungs: the settings of each, from the least model to the most. term: of the error budget. model: of the FMU that
    they belong to, by its name; None: the master. compared: how many rungs further the model is that shows what this
    one lacks (math.inf: the last rung). complete: the last rung lacks nothing; where it may, it is there for
    comparison only. exact: nor does the first one, here."""

    name: str
    term: str
    model: str | None
    rungs: tuple[Mapping[str, Value], ...]
    compared: float = 1
    complete: bool = False
    exact: bool = False

    @property
    def last(self) -> int:
        """The highest rung that can be chosen."""
        return len(self.rungs) - (1 if self.complete else 2)

    def above(self, rung: int) -> int:
        return 0 if self.exact and rung == 0 else int(min(rung + self.compared, len(self.rungs) - 1))


Ladder = tuple[Axis, ...]

_TOLERANCES = tuple(10.0**-k for k in range(1, 11))
# The mesh is the same from 1e-2 to 1e-4, so nothing would show between them.
_REDUCED: tuple[Mapping[str, Value], ...] = tuple(
    {"level": "reduced", "tolerance": t} for t in (1e-3, 1e-5, 1e-6, 1e-7, 1e-8)
)
_AXES: Ladder = (
    Axis(
        "heat",
        "space",
        THERMAL,
        ({"level": "lumped"}, *_REDUCED),
    ),
    # Against all strains: twist alone shows nothing where bending goes with shear.
    Axis(
        "strains",
        "model",
        ROD,
        tuple({"strains": s} for s in ("bending", "extensible", "kirchhoff", "cosserat")),
        math.inf,
        complete=True,
    ),
    Axis("inertia", "model", ROD, ({"dynamic": False}, {"dynamic": True}), complete=True),
    # Two orders further: one more may show nothing where shapes are symmetric.
    Axis("order", "space", ROD, tuple({"order": n} for n in range(8)), 2),
    Axis("step", "time", ROD, tuple({"tolerance": t} for t in _TOLERANCES)),
    Axis("macro", "coupling", None, tuple({"macro_step": 0.5**k} for k in range(8))),  # shares of the scene's own
)
# What an unheated section may be: of all models the one that loads fastest, since nothing is computed with it.
_AT_REST: Mapping[str, Value] = {REST: True, "level": "lumped", "tolerance": 0.1}
# What is the same for every choice: methods that need no tuning, and no loop where none is needed.
_FIXED: dict[str, Mapping[str, Value]] = {ROD: {"method": "rosenbrock"}}


def ladder(scene: Scene) -> Ladder:
    """The axes that the scene's FMUs have."""
    axes = list(_AXES)
    if unheated(scene):
        axes[0] = replace(axes[0], rungs=(_AT_REST, *axes[0].rungs), exact=True)
    if (azimuth := plane(scene)) is not None:
        planar = ({"planar": True, "plane": azimuth}, {"planar": False, "plane": azimuth})
        axes.insert(2, Axis("plane", "model", ROD, planar, complete=True))
    return tuple(
        axis
        for axis in axes
        if axis.model is None
        or ((member := scene.model(axis.model)) and all(k in member.archive.variables for k in axis.rungs[-1]))
    )


def settings(scene: Scene, choice: Choice) -> dict[str, Value]:
    """What a choice sets, by the keys of a scene file and REST, which no file can; enumerations by name, the macro step
    in s. Axes that are not in it stay as the scene has them."""
    found: dict[str, Value] = {}
    for axis in (axis for axis in ladder(scene) if axis.name in choice):
        member = scene.model(axis.model) if axis.model else None
        name = member.name if member else "coupling"
        found |= {f"{name}.{key}": value for key, value in axis.rungs[choice[axis.name]].items()}
    for model, fixed in _FIXED.items():
        if member := scene.model(model):
            found |= {f"{member.name}.{key}": value for key, value in fixed.items()}
    found["coupling.macro_step"] = scene.coupling.macro_step * float(found.get("coupling.macro_step", 1.0))
    return found


def applied(scene: Scene, choice: Choice) -> Scene:
    """The scene with that choice: loops closed inside the rod, macro steps of one length. Its FMUs stay unpacked until
    the process ends."""
    chosen = settings(scene, choice)
    members = tuple(
        _set(m, {k.removeprefix(f"{m.name}."): v for k, v in chosen.items() if k.startswith(f"{m.name}.")})
        for m in scene.members
    )
    coupling = replace(scene.coupling, macro_step=float(chosen["coupling.macro_step"]), control="fixed")
    accuracy = replace(scene.accuracy, level="given")
    return closed_inside(replace(scene, members=members, coupling=coupling, accuracy=accuracy))


def _set(member: Member, chosen: Mapping[str, Value]) -> Member:
    about = member.archive.variables
    indices = {k: about[k].items.index(v) + 1 if isinstance(v, str) else v for k, v in chosen.items() if k != REST}
    return replace(
        member,
        archive=kept(member.archive.path),
        parameters={**member.parameters, **indices},
        frozen=member.frozen or bool(chosen.get(REST)),
    )
