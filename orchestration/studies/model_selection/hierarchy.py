"""What can be chosen, as data: hierarchies of models, each with its levels from the coarsest to the finest.

A choice is one level in each hierarchy.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

from ...fmi.archive import cached_archive
from ...scene import Member, Scene
from ...scene.loop_closure import closed_inside
from ...scene.manipulator import ROD, THERMAL
from .dimensionless_numbers import is_unheated
from .symmetry import symmetry_plane

__all__ = [
    "FROZEN",
    "Choice",
    "Hierarchies",
    "ModelHierarchy",
    "apply_choice",
    "choice_settings",
    "highest_level",
    "model_hierarchies",
    "up_to",
    "with_required",
]

FROZEN = "frozen"  # the one key of a level that is not an FMU parameter: the member is never stepped
Value = float | int | bool | str
Choice = Mapping[str, int]  # name of a hierarchy -> index of the level


@dataclass(frozen=True)
class ModelHierarchy:
    """Models of one aspect, ordered from the coarsest to the finest.

    Parameters
    ----------
    name : str
        Key of the hierarchy in a choice.
    term : str
        Term of the error budget that it contributes to: model, space, time or coupling.
    model : str or None
        Model name of the FMU whose parameters the levels set; None: the master's settings.
    levels : tuple of mappings
        Settings of each level.
    compared : float
        Distance in levels to the one that shows what a level lacks; `math.inf`: the finest.
    complete : bool
        Whether the finest level lacks nothing. Where it may, it serves for comparison only.
    exact : bool
        Whether the coarsest level lacks nothing either, for this scene.
    requires : mapping of str to int
        Least levels of other hierarchies wherever this one is above its coarsest level.
    """

    name: str
    term: str
    model: str | None
    levels: tuple[Mapping[str, Value], ...]
    compared: float = 1
    complete: bool = False
    exact: bool = False
    requires: Mapping[str, int] = field(default_factory=dict)

    @property
    def highest(self) -> int:
        """Index of the finest level that can be chosen."""
        return len(self.levels) - (1 if self.complete else 2)

    def comparison_level(self, level: int) -> int:
        """Index of the level whose difference to `level` estimates the error of `level`."""
        return 0 if self.exact and level == 0 else int(min(level + self.compared, len(self.levels) - 1))


Hierarchies = tuple[ModelHierarchy, ...]


def up_to(hierarchies: Hierarchies, choice: Choice, names: Collection[str]) -> Hierarchies:
    """The hierarchies, in which those of these names end at the level chosen."""
    return tuple(
        replace(h, levels=h.levels[: choice[h.name] + 1], complete=True) if h.name in names else h for h in hierarchies
    )


def highest_level(hierarchies: Hierarchies, name: str) -> int:
    """Number of the finest level of the hierarchy of that name."""
    return next(h.highest for h in hierarchies if h.name == name)


def with_required(hierarchies: Hierarchies, choice: Choice) -> Choice:
    """The choice, made finer where the levels of some hierarchies require it of others."""
    levels = dict(choice)
    for hierarchy in hierarchies:
        if choice[hierarchy.name] > 0:
            levels |= {name: max(levels[name], least) for name, least in hierarchy.requires.items() if name in levels}
    return levels


_TOLERANCES = tuple(10.0**-k for k in range(1, 11))
# The mesh is the same from 1e-2 to 1e-4, so levels between them would not differ.
_REDUCED: tuple[Mapping[str, Value], ...] = tuple(
    {"level": "reduced", "tolerance": t} for t in (1e-3, 1e-5, 1e-6, 1e-7, 1e-8)
)
# Where the heat transfer changes, no reduced model holds; a finer one takes half a minute.
_FULL: tuple[Mapping[str, Value], ...] = tuple({"level": "full", "tolerance": t} for t in (1e-3, 1e-4, 1e-5))
_HIERARCHIES: Hierarchies = (
    ModelHierarchy("heat", "space", THERMAL, ({"level": "lumped"}, *_REDUCED)),
    # Compared with all strains: twist alone changes nothing where bending goes with shear.
    ModelHierarchy(
        "strains",
        "model",
        ROD,
        tuple({"strains": s} for s in ("bending", "extensible", "kirchhoff", "cosserat")),
        math.inf,
        complete=True,
    ),
    ModelHierarchy("inertia", "model", ROD, ({"dynamic": False}, {"dynamic": True}), complete=True),
    # Compared two orders further: one more may change nothing where shapes are symmetric.
    ModelHierarchy("order", "space", ROD, tuple({"order": n} for n in range(8)), 2),
    ModelHierarchy("step", "time", ROD, tuple({"tolerance": t} for t in _TOLERANCES)),
    # Shares of the scene's own macro step; the shortest ones resolve a contact that the scene's own does not.
    ModelHierarchy("macro", "coupling", None, tuple({"macro_step": 0.5**k} for k in range(10))),
)
# The heat of an unheated section: the model that loads fastest, since nothing is computed with it.
_FROZEN_HEAT: Mapping[str, Value] = {FROZEN: True, "level": "lumped", "tolerance": 0.1}
# Settings of every choice: an integrator that needs no tuning.
_FIXED: dict[str, Mapping[str, Value]] = {ROD: {"method": "rosenbrock"}}


def model_hierarchies(scene: Scene) -> Hierarchies:
    """The hierarchies that the scene's FMUs offer."""
    hierarchies = list(_HIERARCHIES)
    if any(_has_varying_convection(thermal) for thermal in scene.models(THERMAL)):
        hierarchies[0] = replace(hierarchies[0], levels=(hierarchies[0].levels[0], *_FULL))
    if is_unheated(scene):
        hierarchies[0] = replace(hierarchies[0], levels=(_FROZEN_HEAT, *hierarchies[0].levels), exact=True)
    if (azimuth := symmetry_plane(scene)) is not None:
        planar = ({"planar": True, "plane": azimuth}, {"planar": False, "plane": azimuth})
        hierarchies.insert(2, ModelHierarchy("plane", "model", ROD, planar, complete=True))
    return tuple(
        hierarchy
        for hierarchy in hierarchies
        if hierarchy.model is None
        or (
            (members := scene.models(hierarchy.model))
            and all(k in member.archive.variables for member in members for k in hierarchy.levels[-1])
        )
    )


def _has_varying_convection(thermal: Member) -> bool:
    return "convection" in thermal.archive.variables and thermal.choice("convection") != "constant"


def choice_settings(scene: Scene, choice: Choice) -> dict[str, Value]:
    """The settings that a choice makes, by the keys of a scene file and FROZEN, which no file can set.

    Enumerations are given by name, the macro step in s. Hierarchies that are missing in the choice stay as the scene
    has them.
    """
    settings: dict[str, Value] = {}
    for hierarchy in (h for h in model_hierarchies(scene) if h.name in choice):
        names = [m.name for m in scene.models(hierarchy.model)] if hierarchy.model else ["coupling"]
        level = hierarchy.levels[choice[hierarchy.name]]
        settings |= {f"{name}.{key}": value for name in names for key, value in level.items()}
    for model, fixed in _FIXED.items():
        for member in scene.models(model):
            settings |= {f"{member.name}.{key}": value for key, value in fixed.items()}
    settings["coupling.macro_step"] = scene.coupling.macro_step * float(settings.get("coupling.macro_step", 1.0))
    return settings


def apply_choice(scene: Scene, choice: Choice) -> Scene:
    """The scene with that choice: loops closed inside the rod, macro steps of constant length.

    Its FMUs stay unpacked until the process ends.
    """
    settings = choice_settings(scene, choice)
    members = tuple(
        _with_settings(m, {k.removeprefix(f"{m.name}."): v for k, v in settings.items() if k.startswith(f"{m.name}.")})
        for m in scene.members
    )
    coupling = replace(scene.coupling, macro_step=float(settings["coupling.macro_step"]), control="fixed")
    accuracy = replace(scene.accuracy, level="given")
    return closed_inside(replace(scene, members=members, coupling=coupling, accuracy=accuracy))


def _with_settings(member: Member, settings: Mapping[str, Value]) -> Member:
    variables = member.archive.variables
    parameters = {
        k: variables[k].items.index(v) + 1 if isinstance(v, str) else v for k, v in settings.items() if k != FROZEN
    }
    return replace(
        member.with_values(parameters),
        archive=cached_archive(member.archive.path),
        frozen=member.frozen or bool(settings.get(FROZEN)),
    )
