"""A scene: the FMUs to run, their parameters, inputs and connections, as data.

TOML in, frozen dataclasses out, checked against the FMUs' own XML.

KEYS says what a scene may have, Coupling what its table [coupling] may. Vectors may be given whole, V = [0, 1.5, 3], or
as one value for all elements. Numbers are in the variable's unit, texts carry one, such as "40 mm".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..cosim.settings import Coupling
from ..cosim.topology import Connection
from ..errors import SceneError
from ..fmi.archive import Archive, Variable
from . import validation
from .accuracy_request import AccuracyRequest
from .accuracy_request import read as read_accuracy_request
from .connections import wired
from .doubts import doubt_inertia, doubt_open_loops, doubt_times
from .geometry import SHARED_TABLES, check_profile, check_shared
from .layers import find, load, merged, overriding
from .limits import Limits
from .member import Member
from .members import read_members, recording
from .placement import Placement, placements
from .schema import settings
from .summary import Summary
from .validation import Layer

__all__ = ["KEYS", "TABLES", "Coupling", "Scene", "changed", "read"]


@dataclass(frozen=True)
class Scene:
    """A scene, checked and ready to run."""

    name: str
    title: str
    stop_time: float  # [s]
    members: tuple[Member, ...]
    connections: tuple[Connection, ...]
    coupling: Coupling
    accuracy: AccuracyRequest
    sources: tuple[tuple[str, str], ...]  # origin and text of every layer, for the record
    overrides: tuple[str, ...] = ()  # keys and values that win over the scene's file
    start_time: float = 0.0  # [s]
    tolerance: float | None = None  # relative, handed to every FMU; None: each has its own
    limits: Limits = field(default_factory=Limits)
    placement: Mapping[str, Placement] = field(default_factory=dict)  # where members stand in pictures
    layers: tuple[Layer, ...] = field(default=(), repr=False, compare=False)  # as read, without what they build on
    folder: Path = field(default=Path(), repr=False, compare=False)  # that relative paths start from

    def __repr__(self) -> str:
        return self._summary().text()

    def _repr_html_(self) -> str:
        return self._summary().html()

    def _summary(self) -> Summary:
        return Summary(self.name, self.title, self.stop_time, self.coupling, self.members, self.connections)

    def member(self, name: str) -> Member:
        """Return the member of that name."""
        return next(m for m in self.members if m.name == name)

    def models(self, name: str) -> tuple[Member, ...]:
        """Return the members whose FMU has that model name."""
        return tuple(m for m in self.members if m.archive.description.model_name == name)


KEYS = {
    "title": "one line of text",
    "stop_time": "[s], such as '30 s'; the one key that must be there",
    "start_time": "[s], handed to every FMU; default: 0",
    "tolerance": "relative tolerance handed to every FMU; default: each FMU's own",
    "record": "list of 'fmu.variable' that the result shows beside inputs and outputs",
    "parameters": "name of a parameter set, or a file, or with ssp one in the archive; default: fig3, or what is bound",
    "ssp": "file of an SSP archive, whose FMUs, wiring, values and stop time hold where the scene says nothing else",
    "connections": "list of 'fmu.output -> fmu.input', sums '0.5*a.y + 0.5*b.y -> c.u', or tables",
    "fmus": "table of name = 'file.fmu', in sweep order; default: thermal and rod",
    "coupling": "table of the settings of the master",
    "fidelity": "table: how much model to use, and what for",
    "limits": "table of values beyond which a result is said to be doubtful",
    "placement": "table: where FMUs stand in pictures: position, turn about z, and size and motion of a block",
    "body": "table of parameters of the body, for all FMUs that have them; tcas (1 to 12), segments (1 to 6): its size",
    "tca": "table of parameters of the TCAs, for all FMUs that have them",
    "NAME": "table of the FMU of that name: its parameters, and its inputs as constants or signals",
}
TABLES = {"coupling": Coupling, "fidelity": AccuracyRequest, "limits": Limits}  # of settings
_TOP = tuple(key for key in KEYS if key != "NAME")
_RESERVED = frozenset(_TOP) - set(SHARED_TABLES)  # names that an FMU must not have


def read(
    source: str | Path | Mapping[str, Any],
    overrides: Sequence[str] | Mapping[str, Any] = (),
    archive: Callable[[Path], Archive] = Archive,
    origin: str = "--set",
) -> Scene:
    """Read a scene.

    Parameters
    ----------
    source
        Name of a scene of the package, a .toml or .ssp file, or a table as a file holds one.
    overrides
        Keys and values that win over the file: 'rod.order=2', 'coupling.macro_step=0.05 s', or a table.
    archive
        Opens an FMU; fmi.archive.cached_archive for many runs in one process.
    origin
        Word that messages have for the overrides.

    Raises
    ------
    SceneError
        The message names file, key, value and remedy.
    """
    name, folder, first = _first_layer(source)
    return _read(name, folder, [first, *([overriding(overrides, origin)] if overrides else [])], archive)


def changed(
    scene: Scene,
    overrides: Sequence[str] | Mapping[str, Any],
    archive: Callable[[Path], Archive] = Archive,
    origin: str = "--set",
) -> Scene:
    """Read a scene again with further overrides, as read() takes them. Raises SceneError."""
    if not scene.layers:
        raise SceneError(f"scene {scene.name!r} was not read from a file or table, so nothing can be overridden")
    return _read(scene.name, scene.folder, [*scene.layers, overriding(overrides, origin)], archive)


def _read(name: str, folder: Path, own: list[Layer], archive: Callable[[Path], Archive]) -> Scene:
    """Read the layers of a scene on top of what they build on."""
    layers = [_base(merged(own), own[0], folder, archive), *own]
    top = merged(layers)
    members = recording(read_members(top, layers, _TOP, folder, archive), top.get("record"))
    connections = wired({m.name: m for m in members}, top.get("connections"))
    check_shared(members, connections)
    check_profile(members)
    doubt_open_loops(members, connections)
    doubt_inertia(members)
    stop_time = _stop_time(top, layers[1])
    start_time = _start_time(top, stop_time)
    doubt_times(members, start_time, stop_time)
    return Scene(
        name=name,
        title=_title(top, name, [line for layer in own if layer.overrides for line in layer.text.splitlines()]),
        stop_time=stop_time,
        members=members,
        connections=connections,
        coupling=settings(Coupling, _tables(layers, "coupling"), "coupling."),
        limits=settings(Limits, _tables(layers, "limits"), "limits."),
        placement=placements(layers, {m.name: m for m in members}),
        accuracy=read_accuracy_request(layers, {m.name: m.archive for m in members}),
        sources=tuple((layer.origin, layer.text) for layer in layers),
        overrides=tuple(line for layer in own if layer.overrides for line in layer.text.splitlines()),
        layers=tuple(own),
        folder=folder,
        start_time=start_time,
        tolerance=_tolerance(top),
    )


def _first_layer(source: str | Path | Mapping[str, Any]) -> tuple[str, Path, Layer]:
    """Name of the scene, the folder that its paths start from, and the layer that it is."""
    if not isinstance(source, (str, Path, Mapping)):
        raise SceneError(f"scene {source!r}: {type(source).__name__}; give the name of a scene, a file, or a table")
    if isinstance(source, Mapping):
        name = str(source.get("name", "scene"))
        raw = {key: value for key, value in source.items() if key != "name"}
        return name, Path.cwd(), Layer("scene", "", raw, numbered=False)
    path = find(source, "scenes", "scene")
    return path.stem, path.parent, load(path)


_UNCHANGING = ("title", "coupling.", "fidelity.", "placement.")  # overrides that leave the system as it is
MAX_CHANGES = 3  # overrides that a title names


def _title(top: Mapping[str, tuple[Any, Layer]], name: str, overrides: Sequence[str]) -> str:
    """Title of the scene, and that it is modified, where overrides change more than the title itself."""
    value, layer = top.get("title", (name, None))
    if not isinstance(value, str):
        assert layer is not None
        layer.refuse("title", value, f"wrong type; give {KEYS['title']} in quotes")
    title = " ".join(value.split()) or name
    changes = [" ".join(text.split()) for text in overrides if not text.startswith(_UNCHANGING)]
    if not changes:
        return title
    more = f", and {len(changes) - MAX_CHANGES} more" if len(changes) > MAX_CHANGES else ""
    return f"{title} (modified: {', '.join(changes[:MAX_CHANGES])}{more})"


def _stop_time(top: Mapping[str, tuple[Any, Layer]], first: Layer) -> float:
    raw, layer = top.get("stop_time", (None, first))
    if raw is None:
        layer.refuse("stop_time", None, "missing; add for example stop_time = '30 s', or --set stop_time=30")
    stop_time = validation.number(layer, "stop_time", raw, validation.TIME)
    if stop_time <= 0.0:
        layer.refuse("stop_time", raw, "out of range; a stop time is positive")
    return stop_time


def _start_time(top: Mapping[str, tuple[Any, Layer]], stop_time: float) -> float:
    if "start_time" not in top:
        return 0.0
    raw, layer = top["start_time"]
    start_time = validation.number(layer, "start_time", raw, validation.TIME)
    if not start_time < stop_time:
        layer.refuse("start_time", raw, f"not before the stop time, {stop_time:g} s; give an earlier one")
    return start_time


def _tolerance(top: Mapping[str, tuple[Any, Layer]]) -> float | None:
    if "tolerance" not in top:
        return None
    raw, layer = top["tolerance"]
    return validation.number(layer, "tolerance", raw, _TOLERANCE)


_TOLERANCE = Variable("tolerance", 0, "Real", "local", "fixed", "", "1", {}, least=1e-16, most=1.0)


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
        value, layer = top["ssp"]
        path = folder / value
        if not value or not path.is_file():
            layer.refuse("ssp", value, f"no such file in {folder}; give the {KEYS['ssp']}")
        from . import ssp_reader  # its parsers take long to load

        return ssp_reader.read(path, chosen, archive, _RESERVED)
    return load(find(chosen or "fig3", "parameters", "parameter set", folder))


def _tables(layers: Sequence[Layer], key: str) -> list[tuple[Layer, Mapping[str, Any]]]:
    """The tables of that key, with their layers."""
    tables = [(layer, layer.raw.get(key, {})) for layer in layers]
    for layer, table in tables:
        if not isinstance(table, Mapping):
            layer.refuse(key, table, f"give a table [{key}]")
    return tables
