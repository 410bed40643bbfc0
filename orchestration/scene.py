"""A scene: what is run, as data. TOML in, frozen dataclasses out, checked against the FMUs' own XML.

KEYS says what a scene may have, Coupling what its table [coupling] may. Vectors may be given whole, V = [0, 1.5, 3], or
as one value for all elements. Numbers are in the variable's unit, texts carry one, such as "40 mm". Connected
variables have one unit; where an FMU declares none, any fits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from . import check, described, ssp_reader
from .archive import Archive, Variable, find_fmu, similar
from .asked import Asked
from .asked import read as read_asked
from .check import Layer
from .errors import SceneError
from .exchange import METHODS as EXCHANGES
from .iteration import METHODS as ITERATIONS
from .settings import setting, settings
from .signals import Signal
from .wiring import Connection

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["KEYS", "TABLES", "Coupling", "Member", "Scene", "find", "load", "parameter_sets", "read", "titles"]

Value = float | int | bool | str


@dataclass(frozen=True)
class Coupling:
    """How the master couples. Tolerances are shares of the FMI nominals."""

    macro_step: float = setting(0.1, "length of a macro step, or its first length where `control` adapts it", "s", 1e-9)
    schedule: str = setting(
        "gauss_seidel", "order inside a loop: one after the other, or all at once", choices=("gauss_seidel", "jacobi")
    )
    method: str = setting("iqn", "how a loop is solved; none: explicit, one sweep", choices=("none", *ITERATIONS))
    omega: float = setting(0.25, "relaxation of the first sweeps, or of all where `method` is relaxed", "1", 1e-3, 2.0)
    exchange: str = setting("hermite", "course of inputs known at both ends of a step", choices=tuple(EXCHANGES))
    waveform: str = setting("linear", "course of inputs that a loop iterates", choices=tuple(EXCHANGES))
    tolerance: float = setting(1e-6, "of the estimated coupling error, share of the nominals", "1", 1e-14, 1.0)
    max_sweeps: int = setting(30, "sweeps of a loop before its step fails", least=2, most=1000)
    halvings: int = setting(6, "of a macro step that fails, before the run does", least=0, most=30)
    reach: float = setting(10.0, "how far a guess may go from the start of a step, in nominals", "1", 1e-3)
    control: str = setting("fixed", "length of macro steps", choices=("fixed", "doubling", "embedded"))
    step_tolerance: float = setting(1e-4, "error per step where `control` adapts it", "1", 1e-13, 1.0)


@dataclass(frozen=True)
class Member:
    """One FMU of a scene: what is set once, and what drives its inputs."""

    name: str
    archive: Archive
    parameters: Mapping[str, Value]
    signals: Mapping[str, Signal]

    def value(self, parameter: str) -> Value | None:
        """The value that holds, set or start; None where there is no such parameter."""
        declared = self.archive.variables.get(parameter)
        return self.parameters.get(parameter, declared.start if declared else None)


@dataclass(frozen=True)
class Scene:
    name: str
    title: str
    stop_time: float  # [s]
    members: tuple[Member, ...]
    connections: tuple[Connection, ...]
    coupling: Coupling
    asked: Asked
    sources: tuple[tuple[str, str], ...]  # origin and text of every layer, for the record

    def __repr__(self) -> str:
        return described.text(self)

    def _repr_html_(self) -> str:
        return described.html(self)

    def member(self, name: str) -> Member:
        return next(m for m in self.members if m.name == name)

    def model(self, name: str) -> Member | None:
        """The member whose FMU is that model."""
        return next((m for m in self.members if m.archive.description.modelName == name), None)


# source, target, and when: by default equal names are wired; what the master must iterate only where it acts.
DEFAULT_WIRING: tuple[tuple[str, str, Callable[[Scene], bool]], ...] = (
    ("thermal.T", "rod.T", lambda scene: True),
    ("rod.delta", "rod.delta_guess", lambda scene: scene.member("rod").value("closure") == 2),
    ("rod.delta", "thermal.delta", lambda scene: scene.member("thermal").value("tca.beta") != 0.0),
)
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
TABLES = {"coupling": Coupling, "fidelity": Asked}  # of settings
_TOP = tuple(key for key in KEYS if key != "NAME")
_FMUS = {"thermal": "thermal.fmu", "rod": "rod.fmu"}


def titles(folder: str = "scenes") -> dict[str, tuple[str, Path]]:
    """Title and file of every scene that comes with the package, by name; nothing else in them is looked at. folder:
    of the package, with other files that have titles."""
    return {name: (str(load(path).raw.get("title", name)), path) for name, path in _shipped(folder).items()}


def parameter_sets() -> tuple[str, ...]:
    """The names of the parameter sets that come with the package."""
    return tuple(_shipped("parameters"))


def read(source: str | Path, overrides: Sequence[str] = (), archive: Callable[[Path], Archive] = Archive) -> Scene:
    """The scene of that name or file. overrides: 'key=value' as in a scene, such as 'rod.order=2',
    'coupling.macro_step=0.05 s'. archive: opens an FMU; archive.kept for many runs in one process. Raises SceneError,
    which names file, key, value and remedy."""
    path = find(source, "scenes", "scene")
    layers = [load(path)]
    if overrides:
        layers.append(_override(overrides))
    layers.insert(0, _base(_merge_top(layers), layers[0], path.parent, archive))
    top = _merge_top(layers)
    members = _members(top, layers, path.parent, archive)
    stop_raw, stop_layer = top.get("stop_time", (None, layers[1]))
    if stop_raw is None:
        stop_layer.refuse("stop_time", None, "missing; add for example stop_time = '30 s'")
    stop_time = check.number(stop_layer, "stop_time", stop_raw, check.TIME)
    if stop_time <= 0.0:
        stop_layer.refuse("stop_time", stop_raw, "out of range; a stop time is positive")
    scene = Scene(
        name=path.stem,
        title=str(top.get("title", (path.stem,))[0]),
        stop_time=stop_time,
        members=members,
        connections=(),
        coupling=_coupling(layers),
        asked=read_asked(layers, {m.name: m.archive for m in members}),
        sources=tuple((layer.origin, layer.text) for layer in layers),
    )
    return _wired(scene, top.get("connections"))


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


def _shipped(folder: str) -> dict[str, Path]:
    place = Path(str(resources.files(__package__))) / folder
    return {file.stem: file for file in sorted(place.glob("*.toml"))}


def find(source: str | Path, folder: str, kind: str, near: Path | None = None) -> Path:
    """The file of that path (also from the folder `near`), or of that name in a folder of the package. Raises
    SceneError."""
    shipped = _shipped(folder)
    for candidate in (Path(source), (near or Path()) / source):
        if candidate.suffix in (".toml", ".ssp") and candidate.is_file():
            return candidate
    if str(source) in shipped:
        return shipped[str(source)]
    raise SceneError(f"no {kind} {str(source)!r}: no such file, and {similar(str(source), list(shipped))}")


def load(path: Path) -> Layer:
    """A TOML file; an SSP archive alone is a scene that names no more than it. Raises SceneError."""
    if path.suffix == ".ssp":
        return Layer(str(path), "", {"ssp": path.name})
    try:
        text = path.read_text(encoding="utf-8")
        return Layer(str(path), text, tomllib.loads(text))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SceneError(f"{path}: cannot be read: {error}") from error


def _override(overrides: Sequence[str]) -> Layer:
    raw: dict[str, Any] = {}
    for text in overrides:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not key:
            raise SceneError(f"--set {text!r}: not of the form key=value, such as rod.order=2")
        try:
            parsed = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            parsed = value
        table, dot, name = key.partition(".")
        if not isinstance(raw.get(table, {}), dict if dot else object):
            raise SceneError(f"--set {text!r}: {table} is set as a whole as well; keep one of the two")
        if dot:
            raw.setdefault(table, {})[name] = parsed
        else:
            raw[table] = parsed
    return Layer("--set", "\n".join(overrides), raw, numbered=False)


def _merge_top(layers: Sequence[Layer]) -> dict[str, tuple[Any, Layer]]:
    return {key: (value, layer) for layer in layers for key, value in layer.raw.items()}


def _members(
    top: Mapping[str, tuple[Any, Layer]], layers: Sequence[Layer], folder: Path, archive: Callable[[Path], Archive]
) -> tuple[Member, ...]:
    given = [layer.raw["fmus"] for layer in layers if "fmus" in layer.raw]
    where = top["fmus"][1] if given else layers[-1]
    for table in given:
        if not isinstance(table, Mapping) or not table:
            where.refuse("fmus", table, "wants a table of name = 'file.fmu'")
    in_file = [layer for layer in layers if "fmus" in layer.raw and layer.numbered]
    files = {name: file for table in [*([] if in_file else [_FMUS]), *given] for name, file in table.items()}
    for name, file in files.items():
        if not isinstance(file, str):
            where.refuse(f"fmus.{name}", file, "wrong type; give a file name such as 'rod.fmu'")
    for layer in layers:
        for key, value in layer.raw.items():
            if key in files and not isinstance(value, Mapping):
                layer.refuse(key, value, f"wants a table [{key}]")
            if key not in files and key not in _TOP:
                layer.refuse(
                    key,
                    None,
                    f"unknown {'section' if isinstance(value, Mapping) else 'key'}; {similar(key, (*_TOP, *files))}",
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
                    signals[full] = check.signal(layer, place, element, variable)
                elif variable.causality in ("parameter", "input"):  # inputs that are not Real are constant
                    parameters[full] = check.scalar(layer, place, element, variable)
                else:
                    layer.refuse(place, element, f"is {variable.causality}; only parameters and inputs can be set")
    return Member(name, archive, parameters, signals)


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names of nested tables; a table that is a signal stays whole."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not any(kind in value for kind in check.SIGNALS):
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


def _coupling(layers: Sequence[Layer]) -> Coupling:
    tables = [(layer, layer.raw.get("coupling", {})) for layer in layers]
    for layer, table in tables:
        if not isinstance(table, Mapping):
            layer.refuse("coupling", table, "wants a table [coupling]")
    return settings(Coupling, tables, "coupling.")


def _wired(scene: Scene, given: tuple[Any, Layer] | None) -> Scene:
    """The scene with its connections: those given, or the default ones whose target no signal drives."""
    if given is None:
        members = {m.name for m in scene.members}
        pairs = [p for p in DEFAULT_WIRING if {p[0].split(".")[0], p[1].split(".")[0]} <= members and p[2](scene)]
        found = [
            c for source, target, _ in pairs for c in _connect(scene, source, target, Layer("default wiring", "", {}))
        ]
        found = [c for c in found if c.target[1] not in scene.member(c.target[0]).signals]
    else:
        found = _given_connections(scene, *given)
    return replace(scene, connections=tuple(found))


def _given_connections(scene: Scene, texts: Any, layer: Layer) -> list[Connection]:
    found: dict[tuple[str, str], Connection] = {}
    if not isinstance(texts, list):
        layer.refuse("connections", texts, "wants a list of 'fmu.output -> fmu.input'")
    for text in texts:
        source, arrow, target = text.partition("->") if isinstance(text, str) else ("", "", "")
        if not arrow:
            layer.refuse("connections", text, "wants 'fmu.output -> fmu.input'")
        for connection in _connect(scene, source.strip(), target.strip(), layer):
            if connection.target[1] in scene.member(connection.target[0]).signals:
                layer.refuse(
                    "connections", text, f"{'.'.join(connection.target)} is set as well; remove one of the two"
                )
            if connection.target in found:
                layer.refuse("connections", text, f"{'.'.join(connection.target)} is fed twice; remove one")
            found[connection.target] = connection
    return list(found.values())


def _connect(scene: Scene, source: str, target: str, layer: Layer) -> list[Connection]:
    text = f"{source} -> {target}"
    ends = [
        _variables(scene, end, causality, text, layer) for end, causality in ((source, "output"), (target, "input"))
    ]
    if len(ends[0]) != len(ends[1]):
        layer.refuse("connections", text, f"{len(ends[0])} outputs for {len(ends[1])} inputs; the counts must agree")
    for (_, a), (_, b) in zip(*ends, strict=True):
        if a.measured and b.measured and (a.dimension, a.unit) != (b.dimension, b.unit):
            layer.refuse("connections", text, f"units differ: {a.unit!r} and {b.unit!r}; connect variables of one unit")
    return [Connection((m, a.name), (n, b.name)) for (m, a), (n, b) in zip(*ends, strict=True)]


def _variables(scene: Scene, end: str, causality: str, text: str, layer: Layer) -> list[tuple[str, Variable]]:
    name, _, key = end.partition(".")
    if name not in [m.name for m in scene.members]:
        layer.refuse("connections", text, f"no FMU {name!r}; {similar(name, [m.name for m in scene.members])}")
    archive = scene.member(name).archive
    scalars = [key] if key in archive.variables else list(archive.vectors.get(key, ()))
    fit = [
        (name, archive.variables[v])
        for v in scalars
        if archive.variables[v].causality == causality and archive.variables[v].type == "Real"
    ]
    if not fit or len(fit) != len(scalars):
        known = [v.name for v in archive.variables.values() if v.causality == causality and v.type == "Real"]
        bases = [base for base, elements in archive.vectors.items() if elements[0] in known]
        layer.refuse("connections", text, f"{end!r} is no Real {causality}; {similar(key, [*known, *bases])}")
    return fit
