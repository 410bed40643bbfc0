"""A scene: what is run, as data. TOML in, frozen dataclasses out, checked against the FMUs' own XML.

KEYS says what a scene may have, Coupling what its table [coupling] may. Vectors may be given whole, V = [0, 1.5, 3], or
as one value for all elements. Numbers are in the variable's unit, texts carry one, such as "40 mm".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..cosim.settings import Coupling
from ..cosim.topology import Connection
from ..fmi.archive import Archive
from . import ssp_reader, summary, validation
from .accuracy_request import AccuracyRequest
from .accuracy_request import read as read_accuracy_request
from .connections import wired
from .layers import find, load, merged, overriding
from .members import Member, read_members
from .schema import settings
from .validation import Layer

__all__ = ["KEYS", "TABLES", "Coupling", "Scene", "read"]


@dataclass(frozen=True)
class Scene:
    name: str
    title: str
    stop_time: float  # [s]
    members: tuple[Member, ...]
    connections: tuple[Connection, ...]
    coupling: Coupling
    accuracy: AccuracyRequest
    sources: tuple[tuple[str, str], ...]  # origin and text of every layer, for the record

    def __repr__(self) -> str:
        return summary.text(self)

    def _repr_html_(self) -> str:
        return summary.html(self)

    def member(self, name: str) -> Member:
        return next(m for m in self.members if m.name == name)

    def model(self, name: str) -> Member | None:
        """The member whose FMU is that model."""
        return next((m for m in self.members if m.archive.description.modelName == name), None)


KEYS = {
    "title": "one line of text",
    "stop_time": "[s], such as '30 s'; the one key that must be there",
    "parameters": "name of a parameter set, or a file, or with ssp one in the archive; default: fig3, or what is bound",
    "ssp": "file of an SSP archive, whose FMUs, wiring, values and stop time hold where the scene says nothing else",
    "connections": "list of 'fmu.output -> fmu.input'; default: what the FMUs need of each other",
    "fmus": "table of name = 'file.fmu', in sweep order; default: thermal and rod",
    "coupling": "table of the settings of the master",
    "fidelity": "table: how much model to use, and what for",
    "NAME": "table of the FMU of that name: its parameters, and its inputs as constants or signals",
}
TABLES = {"coupling": Coupling, "fidelity": AccuracyRequest}  # of settings
_TOP = tuple(key for key in KEYS if key != "NAME")


def read(source: str | Path, overrides: Sequence[str] = (), archive: Callable[[Path], Archive] = Archive) -> Scene:
    """The scene of that name or file. overrides: 'key=value' as in a scene, such as 'rod.order=2',
    'coupling.macro_step=0.05 s'. archive: opens an FMU; cached_archive for many runs in one process. Raises
    SceneError, which names file, key, value and remedy."""
    path = find(source, "scenes", "scene")
    layers = [load(path)]
    if overrides:
        layers.append(overriding(overrides))
    layers.insert(0, _base(merged(layers), layers[0], path.parent, archive))
    top = merged(layers)
    members = read_members(top, layers, _TOP, path.parent, archive)
    stop_raw, stop_layer = top.get("stop_time", (None, layers[1]))
    if stop_raw is None:
        stop_layer.refuse("stop_time", None, "missing; add for example stop_time = '30 s'")
    stop_time = validation.number(stop_layer, "stop_time", stop_raw, validation.TIME)
    if stop_time <= 0.0:
        stop_layer.refuse("stop_time", stop_raw, "out of range; a stop time is positive")
    return Scene(
        name=path.stem,
        title=str(top.get("title", (path.stem,))[0]),
        stop_time=stop_time,
        members=members,
        connections=wired({m.name: m for m in members}, top.get("connections")),
        coupling=_coupling(layers),
        accuracy=read_accuracy_request(layers, {m.name: m.archive for m in members}),
        sources=tuple((layer.origin, layer.text) for layer in layers),
    )


def _base(
    top: Mapping[str, tuple[Any, Layer]], first: Layer, folder: Path, archive: Callable[[Path], Archive]
) -> Layer:
    """What a scene builds on: a parameter set, or an SSP archive with one of its own."""
    for key in ("parameters", "ssp"):
        value, layer = top.get(key, ("", first))
        if not isinstance(value, str):
            layer.refuse(key, value, f"wrong type; give the {KEYS[key]}")
    chosen = top["parameters"][0] if "parameters" in top else None
    if "ssp" in top:
        place = folder / top["ssp"][0]
        if not place.is_file():
            top["ssp"][1].refuse("ssp", top["ssp"][0], f"no such file in {folder}; give the {KEYS['ssp']}")
        return ssp_reader.read(place, chosen, archive)
    return load(find(chosen or "fig3", "parameters", "parameter set", folder))


def _coupling(layers: Sequence[Layer]) -> Coupling:
    tables = [(layer, layer.raw.get("coupling", {})) for layer in layers]
    for layer, table in tables:
        if not isinstance(table, Mapping):
            layer.refuse("coupling", table, "wants a table [coupling]")
    return settings(Coupling, tables, "coupling.")
