"""The manipulator of a scene: its one rod, the cross-sections whose heat bends it, and how both are wired.

Each cross-section is a thermal FMU. With the temperatures T (N,) of all their TCAs one after the other, and the
displacements delta (n,) of the rod's TCAs,

    T_rod = heating T + shift,    delta of the sections' TCAs = straining delta.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import SceneError
from ..scene import Member, Scene
from ..scene.manipulator import DISPLACEMENT, ROD, TEMPERATURE, THERMAL

__all__ = ["Manipulator", "rod_of"]


@dataclass(frozen=True)
class Manipulator:
    """A rod and its cross-sections.

    Attributes
    ----------
    rod : Member
    sections : tuple of Member
    fed : tuple of str
        The rod's inputs T[i] that the sections feed, m of them.
    heating, shift : ndarray, shapes (m, N), (m,)
        See above; shift in K.
    straining : ndarray, shape (N, n)
    """

    rod: Member
    sections: tuple[Member, ...]
    fed: tuple[str, ...]
    heating: np.ndarray
    shift: np.ndarray
    straining: np.ndarray

    @classmethod
    def of(cls, scene: Scene) -> Manipulator:
        """Find the manipulator of a scene.

        Raises
        ------
        SceneError
            The scene has no rod, or several, or its TCAs are heated by something else than thermal FMUs.
        """
        rod = rod_of(scene)
        known = {m.name: m for m in scene.models(THERMAL)}
        if not known:
            raise SceneError(f"{scene.name}: no FMU with the model {THERMAL!r}; planning needs one")
        wires = {
            name: [c for c in scene.connections if c.target == (rod.name, name)]
            for name in rod.archive.vectors[TEMPERATURE]
        }
        for wire in (w for several in wires.values() for w in several):
            section = known.get(wire.source[0])
            if section is None or wire.source[1] not in section.archive.vectors[TEMPERATURE]:
                raise SceneError(
                    f"{scene.name}: {wire.target[0]}.{wire.target[1]} comes from {wire.source[0]}.{wire.source[1]}; "
                    f"plans, maps and observers need temperatures of FMUs with the model {THERMAL!r}"
                )
        used = {c.source[0] for several in wires.values() for c in several}
        if not used:
            raise SceneError(
                f"{scene.name}: no thermal FMU heats {rod.name!r}; plans, maps and observers need a connection such as "
                f"'{next(iter(known))}.T -> {rod.name}.T'"
            )
        sections = tuple(m for m in known.values() if m.name in used)
        columns = [(m.name, T) for m in sections for T in m.archive.vectors[TEMPERATURE]]
        fed = tuple(name for name, several in wires.items() if several)
        heating, shift = np.zeros((len(fed), len(columns))), np.zeros(len(fed))
        for row, name in enumerate(fed):
            for wire in wires[name]:
                heating[row, columns.index(wire.source)] += wire.factor
                shift[row] += wire.offset
        return cls(rod, sections, fed, heating, shift, _straining(scene, rod, sections))


def rod_of(scene: Scene) -> Member:
    """Return the one rod of a scene. Raises SceneError where it has none, or several."""
    rods = scene.models(ROD)
    if not rods:
        raise SceneError(f"{scene.name}: no FMU with the model {ROD!r}; planning needs one")
    if len(rods) > 1:
        names = ", ".join(rod.name for rod in rods)
        raise SceneError(
            f"{scene.name}: {len(rods)} FMUs with the model {ROD!r} ({names}); plans, maps and observers are made for "
            "a scene with one manipulator"
        )
    return rods[0]


def _straining(scene: Scene, rod: Member, sections: tuple[Member, ...]) -> np.ndarray:
    displacements = {(rod.name, name): k for k, name in enumerate(rod.archive.vectors[DISPLACEMENT])}
    rows = [(m.name, name) for m in sections for name in m.archive.vectors[DISPLACEMENT]]
    straining = np.zeros((len(rows), len(displacements)))
    for wire in scene.connections:
        if wire.target in rows and wire.source in displacements:
            straining[rows.index(wire.target), displacements[wire.source]] += wire.factor
    return straining
