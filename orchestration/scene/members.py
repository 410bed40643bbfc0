"""Members of a scene, its FMUs, with the values set in each; every name and value is checked against the FMU's XML."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..cosim.signals import Signal
from ..fmi.archive import Archive, Variable, similar
from . import validation
from .geometry import SHARED_TABLES, distribute
from .manipulator import DEFAULT_FMUS
from .member import Member, Value, set_parameter, settable
from .sizes import open_archives, take_sizes
from .validation import SIGNAL_TYPES, Layer, flat

__all__ = ["read_members", "recording"]


def read_members(
    top: Mapping[str, tuple[Any, Layer]],
    layers: Sequence[Layer],
    keys: Sequence[str],
    folder: Path,
    archive: Callable[[Path], Archive],
) -> tuple[Member, ...]:
    """Read the FMUs of a scene.

    top: what holds under each key at the top of the scene; keys: those that a scene may have beside names of FMUs;
    folder: of the scene's file. Raises SceneError.
    """
    files = _files(top, layers, keys)
    layers = [_grouped(layer, files, keys) for layer in layers]
    layers, sizes = take_sizes(layers, files)
    archives = open_archives(files, folder, sizes, archive)
    layers = distribute(layers, archives)
    for layer in layers:
        for key, value in layer.raw.items():
            if key in files and not isinstance(value, Mapping):
                layer.refuse(key, value, f"give a table [{key}]")
            if key not in files and key not in keys:
                kind = "section" if isinstance(value, Mapping) else "key"
                layer.refuse(key, None, f"unknown {kind}; {similar(key, (*keys, *files))}")
    return tuple(_member(name, archive, layers) for name, archive in archives.items())


def _files(top: Mapping[str, tuple[Any, Layer]], layers: Sequence[Layer], keys: Sequence[str]) -> dict[str, str]:
    """Files of the FMUs by member, in the order of the tables [fmus]; overrides add to them."""
    tables = [(layer, layer.raw["fmus"]) for layer in layers if "fmus" in layer.raw]
    for layer, table in tables:
        if not isinstance(table, Mapping) or not table:
            layer.refuse("fmus", table, "give a table of name = 'file.fmu'")
    in_file = any(not layer.overrides for layer, _ in tables)
    files: dict[str, Any] = {} if in_file else dict(DEFAULT_FMUS)
    for layer, table in tables:
        for name, file in table.items():
            if not isinstance(file, str):
                layer.refuse(f"fmus.{name}", file, "wrong type; give a file name such as 'rod.fmu'")
            if name in keys and name not in SHARED_TABLES:
                layer.refuse(f"fmus.{name}", file, f"the name {name!r} is taken by a key of scenes; rename the FMU")
            files[name] = file
    return files


def _grouped(layer: Layer, files: Mapping[str, str], keys: Sequence[str]) -> Layer:
    """The layer with the values of members whose names hold dots under these names: axle.motor.k of axle.motor."""
    dotted = [name for name in files if "." in name]
    if not dotted:
        return layer
    raw: dict[str, Any] = {}
    for key, value in layer.raw.items():
        if key in keys or not isinstance(value, Mapping) or key in dotted:
            raw[key] = {**raw.get(key, {}), **value} if isinstance(value, Mapping) and key in dotted else value
            continue
        for name, item in flat(value, f"{key}."):
            owner = max((m for m in files if name.startswith(f"{m}.")), key=len, default=None)
            if owner is None:
                raw.setdefault(key, {})[name[len(key) + 1 :]] = item
            else:
                raw.setdefault(owner, {})[name[len(owner) + 1 :]] = item
    return replace(layer, raw=raw)


def _member(name: str, archive: Archive, layers: Sequence[Layer]) -> Member:
    parameters: dict[str, Value] = {}
    signals: dict[str, Signal] = {}
    tables = [dict(flat(layer.raw.get(name, {}))) for layer in layers]
    for k, (layer, table) in enumerate(zip(layers, tables, strict=True)):
        for key, raw in table.items():
            # A list for another number of TCAs, in the place of which a later layer, such as --set, has its own.
            if any(key in later for later in tables[k + 1 :]) and _has_other_length(raw, archive.vectors.get(key, ())):
                continue
            for full, element in _elements(layer, name, key, raw, archive):
                variable, label = archive.variables[full], f"{name}.{full}"
                parameters.pop(full, None)  # the last to be given is the last to be set
                driven = variable.type == "Real" or isinstance(element, (Mapping, SIGNAL_TYPES))
                if variable.causality == "input" and driven:
                    signals[full] = validation.signal(layer, label, element, variable)
                elif variable.causality in ("parameter", "input") or _has_start(
                    variable
                ):  # inputs of other types may be constant
                    set_parameter(parameters, full, validation.scalar(layer, label, element, variable), archive)
                    signals.pop(full, None)
                else:
                    layer.refuse(label, element, _not_settable(variable))
    return Member(name, archive, parameters, signals)


def _has_other_length(raw: Any, elements: Sequence[str]) -> bool:
    values = raw.get("columns") if isinstance(raw, Mapping) else raw
    return isinstance(values, list) and len(values) != len(elements)


def recording(members: tuple[Member, ...], given: tuple[Any, Layer] | None) -> tuple[Member, ...]:
    """Return the members with the variables that the key `record` names. Raises SceneError."""
    if given is None:
        return members
    names, layer = given
    if not isinstance(names, list):
        layer.refuse("record", names, "wrong type; give a list of 'fmu.variable'")
    recorded: dict[str, set[str]] = {member.name: set() for member in members}
    known: dict[str, tuple[str, tuple[str, ...]]] = {}
    for member in members:
        known |= {f"{member.name}.{base}": (member.name, v) for base, v in member.archive.vectors.items()}
        known |= {f"{member.name}.{name}": (member.name, (name,)) for name in member.archive.variables}
    for name in names:
        if name not in known:
            layer.refuse("record", name, f"no such variable; {similar(str(name), list(known))}")
        owner, variables = known[name]
        recorded[owner].update(variables)
    return tuple(replace(member, recorded=frozenset(recorded[member.name])) for member in members)


def _flattened(layer: Layer, key: str, raw: Any, shape: tuple[int, ...]) -> list[Any]:
    """Return the elements of nested lists, the last index fastest. Raises SceneError where their shape is another."""
    try:
        array = np.empty(shape, dtype=object)
        array[...] = raw
    except ValueError:
        layer.refuse(key, raw, f"another shape; give lists of {' lists of '.join(map(str, shape))} elements")
    return list(array.flat)


def _has_start(variable: Variable) -> bool:
    """Whether the start value of an output or local variable, such as a state, can be set before initialisation."""
    changeable = variable.causality in ("output", "local") and variable.variability not in ("constant", "fixed")
    return changeable and variable.start is not None


def _not_settable(variable: Variable) -> str:
    return f"is {variable.causality}; only parameters, inputs and start values can be set"


def _elements(layer: Layer, member: str, key: str, raw: Any, archive: Archive) -> list[tuple[str, Any]]:
    """The scalar variables that a key stands for, each with its raw value.

    Where an FMU of this package has a vector and a scalar of that name, which sets all its elements, one value is that
    of all of them.
    """
    elements = archive.vectors.get(key)
    if key in archive.variables and not (elements and isinstance(raw, list)):
        every = elements if elements and archive.reentrant else ()
        return [(name, raw) for name in (key, *every)]
    if elements is None:
        _refuse_name(layer, member, key, raw, archive)
    if isinstance(raw, Mapping) and isinstance(raw.get("columns"), list):  # one file has the signals of all elements
        others = {entry: value for entry, value in raw.items() if entry != "columns"}
        raw = [{**others, "column": column} for column in raw["columns"]]
    if not isinstance(raw, list):
        return [(element, raw) for element in elements]
    vector = archive.arrays[key]
    if not vector.complete:
        layer.refuse(
            f"{member}.{key}", raw, f"its indices have gaps: {', '.join(elements[:4])}, ...; set these one by one"
        )
    if any(isinstance(row, list) for row in raw):
        raw = _flattened(layer, f"{member}.{key}", raw, vector.shape)
    if len(raw) != len(elements):
        layer.refuse(
            f"{member}.{key}", raw, f"{len(raw)} values for {len(elements)} elements of {key}; give {len(elements)}"
        )
    return list(zip(elements, raw, strict=True))


def _refuse_name(layer: Layer, member: str, key: str, raw: Any, archive: Archive) -> NoReturn:
    """Refuse a key that names no variable, by what it may have been meant for."""
    for cut in (k for k, character in enumerate(key) if character == "."):
        if key[:cut] in archive.variables or key[:cut] in archive.vectors:
            word = key[cut + 1 :]
            if word in ("file", "column", "columns"):
                problem = "give a file and its column: { file = 'volts.csv', column = 'V1', hold = 'linear' }"
                layer.refuse(f"{member}.{key[:cut]}", {word: raw}, problem)
            kind = word.partition(".")[0]
            if kind in validation.SIGNALS:
                problem = f"a part of a signal; set it as a whole: {member}.{key[:cut]}={{{kind}={{...}}}}"
                layer.refuse(f"{member}.{key}", raw, problem)
            problem = f"{word!r} is not a signal; {similar(word, (*validation.SIGNALS, 'file'))}"
            layer.refuse(f"{member}.{key[:cut]}", {word: raw}, problem)
    base, bracket, _ = key.rpartition("[")
    if bracket and base in archive.vectors:
        elements = archive.vectors[base]
        layer.refuse(f"{member}.{key}", raw, f"no such element; {base} has {elements[0]} to {elements[-1]}")
    layer.refuse(f"{member}.{key}", raw, f"no such variable in {archive.path.name}; {similar(key, settable(archive))}")
