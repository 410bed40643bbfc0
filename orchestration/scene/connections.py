"""Connections of a scene: texts 'fmu.output -> fmu.input' or tables, checked against the FMUs and their units.

Connected variables measure the same quantity; values are converted where their units differ. Where one end declares no
unit, any fits. Names may hold any character: a text is split where both its ends name a variable; where that leaves a
choice, or none, a table {from = "fmu.output", to = "fmu.input"} says it.

A source may be a weighted sum: '0.5*lower.T + 0.5*upper.T -> rod.T', with spaces round its signs, or as a table
{terms = [{from = "lower.T", factor = 0.5}, {from = "upper.T", factor = 0.5}], to = "rod.T"}.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..cosim.topology import Connection
from ..errors import SceneWarning
from ..fmi.archive import Variable, similar
from .manipulator import DEFAULT_WIRING
from .member import Member
from .unit_conversion import conversion, unit_of
from .validation import LEAST_NOMINAL, Layer

__all__ = ["wired"]

_ARROW = "->"
_KEYS = ("from", "to", "factor", "offset", "convert")


def wired(members: Mapping[str, Member], given: tuple[Any, Layer] | None) -> tuple[Connection, ...]:
    """Return the connections given, or the default ones whose target no signal drives.

    members: by name; given: the value of the key `connections` and the layer that has it. Raises SceneError.
    """
    if given is not None:
        return tuple(_given_connections(members, *given))
    layer = Layer("default wiring", "", {})
    pairs = [(a, b) for a, b, acts in DEFAULT_WIRING if {a[0], b[0]} <= set(members) and acts(members)]
    pairs = [(a, b) for a, b in pairs if _has(members, a) and _has(members, b)]
    connections = [c for a, b in pairs for c in _connect(members, a, b, f"{'.'.join(a)} -> {'.'.join(b)}", layer)]
    return tuple(c for c in connections if c.target[1] not in members[c.target[0]].signals)


def _has(members: Mapping[str, Member], end: tuple[str, str]) -> bool:
    archive = members[end[0]].archive
    return end[1] in archive.variables or end[1] in archive.vectors


def _given_connections(members: Mapping[str, Member], entries: Any, layer: Layer) -> list[Connection]:
    connections: dict[tuple[str, str, int], Connection] = {}
    if not isinstance(entries, list):
        layer.refuse("connections", entries, "give a list of 'fmu.output -> fmu.input'")
    for entry in entries:
        for connection in _entry_connections(members, entry, layer):
            name, text = ".".join(connection.target), str(connection)
            member = members[connection.target[0]]
            if connection.target[1] in member.signals or connection.target[1] in member.parameters:
                layer.refuse("connections", text, f"{name} is set as well; remove one of the two")
            fed = connections.get((*connection.target, 0))
            if fed is not None and connection.term == 0:
                layer.refuse(
                    "connections", text, f"{name} is fed twice; remove one, or give a sum: 'a.x + b.y -> {name}'"
                )
            connections[(*connection.target, connection.term)] = connection
    return list(connections.values())


_TERM = re.compile(r"(?:(?P<weight>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*\*\s*)?(?P<end>\S.*)")
_SIGN = re.compile(r"\s([-+])\s")


def _entry_connections(members: Mapping[str, Member], entry: Any, layer: Layer) -> list[Connection]:
    """Connections of one entry: one for each element, and for each term of a sum."""
    if isinstance(entry, Mapping) and "terms" in entry:
        return _terms(members, entry, layer)
    if isinstance(entry, str) and _ARROW in entry:
        source, target = _split(members, entry)
        if not _candidates(members, source) and (_SIGN.search(source) or "*" in source):
            return _summed(members, source, target, entry, layer)
    text, source_end, target_end, scale = _parsed(members, entry, layer)
    return _connect(members, source_end, target_end, text, layer, *scale)


def _terms(members: Mapping[str, Member], entry: Mapping[str, Any], layer: Layer) -> list[Connection]:
    """Connect the sum of a table: {terms = [{from, factor, offset}, ...], to}, for names that a text cannot hold."""
    terms, others = entry["terms"], sorted(set(entry) - {"terms", "to"})
    if others or "to" not in entry or not isinstance(terms, list) or len(terms) < 2:
        layer.refuse("connections", dict(entry), "give {terms = [{from, factor, offset}, ...], to}, two terms or more")
    connections = []
    for k, term in enumerate(terms):
        if not isinstance(term, Mapping) or "to" in term:
            layer.refuse("connections", term, "give a term as a table {from, factor, offset}")
        text, source, target, scale = _parsed(members, {**term, "to": entry["to"]}, layer)
        connections += [
            replace(c, term=k, terms=len(terms)) for c in _connect(members, source, target, text, layer, *scale)
        ]
    sources = [(c.source, c.target) for c in connections]
    if len(set(sources)) < len(sources):
        layer.refuse("connections", dict(entry), "two terms have one output; add their factors")
    return connections


def _summed(members: Mapping[str, Member], source: str, target: str, text: str, layer: Layer) -> list[Connection]:
    """Connect a weighted sum of outputs to an input, of vectors element by element."""
    weights: dict[tuple[str, str], float] = {}
    parts = _SIGN.split(f" + {source}" if not source.startswith(("- ", "+ ")) else f" {source}")
    for sign, part in zip(parts[1::2], parts[2::2], strict=True):
        term = _TERM.fullmatch(part.strip())
        if term is None:
            layer.refuse("connections", text, f"{part.strip()!r} is not a term; give 0.5*fmu.output")
        end = _end(members, term["end"].strip(), text, layer)
        weights[end] = weights.get(end, 0.0) + float(sign + "1") * float(term["weight"] or 1.0)
    if not all(weights.values()) or not all(map(math.isfinite, weights.values())):
        layer.refuse("connections", text, "a weight is 0 or not finite; remove that term")
    into = _end(members, target, text, layer)
    terms = [_connect(members, end, into, text, layer, weight) for end, weight in weights.items()]
    _require_equal_terms(terms, sum(weights.values()), text, layer)
    _doubt_weights(members, terms, sum(weights.values()), text, layer)
    return [replace(c, term=k, terms=len(terms)) for k, term in enumerate(terms) for c in term]


_ROUNDING = 1e-9  # of the sum of weights, which are written with a few digits
_MEAN = 1e-3  # largest difference from 1 of the sum of weights of a mean, written with few digits


def _require_equal_terms(terms: Sequence[Sequence[Connection]], whole: float, text: str, layer: Layer) -> None:
    """Refuse sums that mean nothing: of temperatures in units with another zero, unless they are means."""
    if any(c.offset for term in terms for c in term) and abs(whole - 1.0) > _ROUNDING:
        layer.refuse(
            "connections",
            text,
            f"the units have different zeros, and the weights sum to {whole:g}; let them sum to 1, or give outputs in "
            "the unit of the input",
        )


def _doubt_weights(
    members: Mapping[str, Member], terms: Sequence[Sequence[Connection]], whole: float, text: str, layer: Layer
) -> None:
    """Warn of a sum of temperatures that is no mean: of 300 K and 300 K it makes 600 K."""
    target = terms[0][0].target
    variable = members[target[0]].archive.variables[target[1]]
    is_temperature = variable.dimension == {"K": 1} and not variable.relative and variable.nominal >= LEAST_NOMINAL
    if is_temperature and abs(whole - 1.0) > _MEAN:
        warning = f"{layer.origin}: connections: {text!r}: the weights of temperatures sum to {whole:g}; a mean has 1"
        warnings.warn(warning, SceneWarning, stacklevel=2)


def _parsed(
    members: Mapping[str, Member], entry: Any, layer: Layer
) -> tuple[str, tuple[str, str], tuple[str, str], tuple[float, float, bool]]:
    """Text for messages, source, target, and (factor, offset, whether units are converted)."""
    if isinstance(entry, str):
        if _ARROW not in entry:
            layer.refuse("connections", entry, "give 'fmu.output -> fmu.input'")
        source, target = _split(members, entry)
        return entry, _end(members, source, entry, layer), _end(members, target, entry, layer), (1.0, 0.0, True)
    if not isinstance(entry, Mapping) or not {"from", "to"} <= set(entry):
        layer.refuse("connections", entry, "give 'fmu.output -> fmu.input', or a table with from and to")
    for key in entry:
        if key not in _KEYS:
            layer.refuse("connections", dict(entry), f"unknown {key!r}; allowed: {', '.join(_KEYS)}")
    text = f"{entry['from']} -> {entry['to']}"
    ends = [
        tuple(end) if isinstance(end, tuple) else _end(members, end, text, layer)
        for end in (entry["from"], entry["to"])
    ]
    if isinstance(entry["from"], tuple):  # of an SSP archive, whose names are given apart
        text = f"{'.'.join(ends[0])} -> {'.'.join(ends[1])}"
    factor, offset = (_finite(layer, text, key, entry.get(key, default)) for key, default in _DEFAULTS.items())
    if factor == 0.0:
        layer.refuse("connections", text, "factor is 0; remove the connection and set the input to the offset")
    convert = entry.get("convert", True)
    if not isinstance(convert, bool):
        layer.refuse("connections", text, f"convert = {convert!r}: wrong type; allowed: true, false")
    return text, ends[0], ends[1], (factor, offset, convert)


_DEFAULTS = {"factor": 1.0, "offset": 0.0}


def _finite(layer: Layer, text: str, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        layer.refuse("connections", text, f"{key} = {value!r}: give a finite number")
    return float(value)


def _split(members: Mapping[str, Member], text: str) -> tuple[str, str]:
    """Split at the arrow that leaves a known member on both sides; at the first one where none or several do."""
    starts = [k for k in range(len(text)) if text.startswith(_ARROW, k)]
    pairs = [(text[:k].strip(), text[k + len(_ARROW) :].strip()) for k in starts]
    fitting = [pair for pair in pairs if all(_candidates(members, end) for end in pair)]
    return fitting[0] if len(fitting) == 1 else pairs[0]


def _candidates(members: Mapping[str, Member], end: str) -> list[tuple[str, str]]:
    """The ways to read 'member.variable' where both may hold dots."""
    pairs = [(end[:k], end[k + 1 :]) for k, character in enumerate(end) if character == "."]
    return [pair for pair in pairs if pair[0] in members and _has(members, pair)]


def _end(members: Mapping[str, Member], end: Any, text: str, layer: Layer) -> tuple[str, str]:
    """Member and variable of one end."""
    if not isinstance(end, str):
        layer.refuse("connections", text, f"{end!r}: give a text 'fmu.variable'")
    candidates = _candidates(members, end)
    if len(candidates) > 1:
        readings = " or ".join(f"{variable!r} of {member!r}" for member, variable in candidates)
        layer.refuse("connections", text, f"{end!r} can be read as {readings}; rename one of these FMUs in [fmus]")
    if candidates:
        return candidates[0]
    known = [name for name in members if end.startswith(f"{name}.")]
    name = max(known, key=len) if known else end.partition(".")[0]
    return name, end[len(name) + 1 :]


def _connect(
    members: Mapping[str, Member],
    source: tuple[str, str],
    target: tuple[str, str],
    text: str,
    layer: Layer,
    factor: float = 1.0,
    offset: float = 0.0,
    convert: bool = True,
) -> list[Connection]:
    """Connect two scalars, or two vectors element by element.

    factor, offset: a transformation after the conversion of units.
    """
    outputs = _variables(members, source, "output", text, layer)
    inputs = _variables(members, target, "input", text, layer)
    if len(outputs) != len(inputs):
        layer.refuse(
            "connections", text, f"{len(outputs)} outputs for {len(inputs)} inputs; connect as many outputs as inputs"
        )
    _require_equal_indices(members, source, target, text, layer)
    connections = []
    for a, b in zip(outputs, inputs, strict=True):
        if a.type != b.type:
            layer.refuse("connections", text, f"types differ: {a.type} and {b.type}; connect variables of one type")
        if a.items != b.items or a.item_values != b.item_values:
            layer.refuse("connections", text, f"items differ: {', '.join(a.items)} and {', '.join(b.items)}")
        gain, shift = _conversion(a, b, text, layer) if convert else (1.0, 0.0)
        connections.append(Connection((source[0], a.name), (target[0], b.name), factor * gain, factor * shift + offset))
        if connections[-1].transforms and a.type != "Real":
            layer.refuse("connections", text, f"a factor or offset needs Real variables; these are {a.type}")
    return connections


def _conversion(a: Variable, b: Variable, text: str, layer: Layer) -> tuple[float, float]:
    try:
        gain, shift = conversion(unit_of(a), unit_of(b), a.relative and b.relative)
    except ValueError as error:
        layer.refuse("connections", text, f"{error}; connect variables of one quantity")
    if shift and a.relative != b.relative:
        layer.refuse(
            "connections",
            text,
            f"one of {a.unit!r} and {b.unit!r} is a difference (relativeQuantity) and the other a value; connect like "
            "to like",
        )
    return gain, shift


def _variables(
    members: Mapping[str, Member], end: tuple[str, str], causality: str, text: str, layer: Layer
) -> list[Variable]:
    name, key = end
    if name not in members:
        layer.refuse("connections", text, f"no FMU {name!r}; {similar(name, list(members))}")
    archive = members[name].archive
    scalars = [archive.variables[v] for v in ([key] if key in archive.variables else archive.vectors.get(key, ()))]
    if scalars and all(v.causality == causality for v in scalars):
        return scalars
    known = [v.name for v in archive.variables.values() if v.causality == causality]
    vectors = {base for base, elements in archive.vectors.items() if elements[0] in known}
    elements = {element for base in vectors for element in archive.vectors[base]}
    names = [*vectors, *(name for name in known if name not in elements)]
    layer.refuse("connections", text, f"{'.'.join(end)!r} is not an {causality}; {similar(key, names)}")


def _require_equal_indices(
    members: Mapping[str, Member], source: tuple[str, str], target: tuple[str, str], text: str, layer: Layer
) -> None:
    """Refuse two vectors whose elements do not correspond: by index, or in an array without gaps by position."""
    ends = [members[name].archive.arrays.get(key) for name, key in (source, target)]
    if any(key in members[name].archive.variables for name, key in (source, target)) or None in ends:
        return
    a, b = (vector for vector in ends if vector is not None)
    if a.indices != b.indices and not (a.complete and b.complete and a.shape == b.shape):
        layer.refuse(
            "connections",
            text,
            f"the indices of {'.'.join(source)!r} and {'.'.join(target)!r} differ; connect the elements one by one",
        )
