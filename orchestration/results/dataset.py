"""Result of a run: a table or xarray Dataset with units, descriptions, settings and versions.

Elements of one vector without gaps come as one variable with index dimensions: thermal.T (time, index3), rod.shape.p
(time, index21, index3). Indices are those of the FMU: index3 counts from 1, index3_from0 from 0. Integers, Booleans,
enumerations (numbers, whose words are in the attribute flag_meanings) and strings keep their types. The log of the
coupling lies on the same time axis: coupling.step [s], sweeps, residual and error (shares of the nominals), gain.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..cosim.acceleration import spectral_radius
from ..cosim.master import StepLog
from ..cosim.step_logs import StepLogs
from ..fmi.archive import Variable
from ..fmi.log import Warned
from ..fmi.values import text_of
from ..fmi.vectors import find_vectors
from ..scene import Member, Scene
from .identity import Identity
from .software import versions
from .table import LabelledArray, ResultLike, ResultTable

__all__ = ["arrays", "collect", "describe_vector", "scalars", "scene_record"]

_LOG = {
    "step": ("s", "length of the macro step that ended here"),
    "sweeps": ("1", "sweeps of the loop in it"),
    "residual": ("1", "last residual of the loop, share of the nominals"),
    "error": ("1", "estimated coupling error, share of the nominals"),
    "gain": ("1", "estimated loop gain: spectral radius of one sweep's error map; nan where nothing is known of it"),
}
_MAX_LISTED = 4  # elements whose own words a description lists
_DTYPES = {"Real": float, "Integer": np.int32, "Enumeration": np.int32, "Boolean": bool}


def collect(
    scene: Scene,
    recorded: Mapping[str, Sequence[Variable]],
    first: Mapping[str, np.ndarray],
    logs: Sequence[StepLog],
    status: str,
    warnings: Iterable[Warned] = (),
) -> ResultTable:
    """Collect the result of a run.

    Parameters
    ----------
    scene
        What was run.
    recorded
        Member -> variables of its rows.
    first
        Member -> row of numbers (n,) at the start.
    logs
        Accepted macro steps with the rows at their ends.
    status
        'complete', or why the run ended early.
    warnings
        What the FMUs warned of; kept as the attribute `warnings` (JSON), with the values that are not finite.
    """
    steps = StepLogs.of(logs)
    times = np.concatenate([[scene.start_time], steps.column("time")])
    warned = list(warnings)
    content: dict[str, LabelledArray] = {}
    for name, variables in recorded.items():
        rows = steps.record(name, first[name])
        content |= arrays(name, variables, rows)
        warned += _not_finite(name, variables, times, rows)
    for key, column in _log_columns(steps).items():
        unit, text = _LOG[key]
        content[f"coupling.{key}"] = LabelledArray(("time",), column, {"units": unit, "long_name": text})
    coordinates = {"time": LabelledArray(("time",), times, {"units": "s", "long_name": "time"})}
    attributes = {**scene_record(scene, status), "warnings": json.dumps([asdict(warning) for warning in warned])}
    return ResultTable(content, coordinates | _indices(content), attributes)


def _not_finite(member: str, variables: Sequence[Variable], times: np.ndarray, rows: np.ndarray) -> Iterator[Warned]:
    """Yield a warning for each variable with values that are not finite."""
    bad = ~np.isfinite(rows)
    if not bad.any():
        return
    for k in np.flatnonzero(bad.any(axis=0)).tolist():
        first = int(bad[:, k].argmax())
        yield Warned(member, f"{variables[k].name} is {rows[first, k]}", int(bad[:, k].sum()), float(times[first]))


def arrays(member: str, variables: Sequence[Variable], rows: np.ndarray) -> dict[str, LabelledArray]:
    """Return name -> array of a member's variables.

    Parameters
    ----------
    rows : ndarray, (time, variable)
        Numbers as an FMU's record() gives them.
    """
    content: dict[str, LabelledArray] = {}
    for array in _layout(member, Identity(variables)):
        # A copy, so that a variable that is kept does not keep the others.
        values = rows[:, array.columns].copy().reshape(len(rows), *array.shape)
        content[array.name] = LabelledArray(array.dims, _typed(values, array.variable), dict(array.attributes))
    return content


@dataclass(frozen=True)
class _ArrayLayout:
    """One array of a member: its name, dimensions and attributes, and the columns of the rows that make it up."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]  # without the time
    columns: list[int] | slice  # a slice where they are consecutive, which numpy copies several times faster
    variable: Variable  # the first one of its elements
    attributes: Mapping[str, Any]


@lru_cache(maxsize=64)  # members of the scenes that a process runs again and again
def _layout(member: str, declared: Identity[Sequence[Variable]]) -> tuple[_ArrayLayout, ...]:
    """Return the arrays of a member's variables."""
    variables = declared.it
    columns = {variable.name: k for k, variable in enumerate(variables)}
    vectors = find_vectors(columns)
    base_of: dict[str, str] = {}
    for base, vector in vectors.items():
        alike = {(variables[columns[name]].type, variables[columns[name]].unit) for name in vector.elements}
        if vector.complete and base not in columns and len(alike) == 1:
            base_of |= dict.fromkeys(vector.elements, base)
    layouts: dict[str, _ArrayLayout] = {}
    shape: tuple[int, ...]
    for variable in variables:
        base = base_of.get(variable.name, variable.name)
        name = f"{member}.{base}"
        if name in layouts:
            continue
        dims: tuple[str, ...] = ("time",)
        if base == variable.name:
            shape, chosen, description = (), [columns[base]], variable.description
        else:
            vector = vectors[base]
            shape, chosen = vector.shape, [columns[element] for element in vector.elements]
            dims = ("time", *(_dimension(n, first) for n, first in zip(shape, vector.first, strict=True)))
            description = describe_vector([variables[column].description for column in chosen])
        attributes = _attributes(variable) | {"long_name": description}
        first, end = chosen[0], chosen[-1] + 1
        consecutive = chosen == list(range(first, end))
        layouts[name] = _ArrayLayout(
            name, dims, shape, slice(first, end) if consecutive else chosen, variable, attributes
        )
    return tuple(layouts.values())


def describe_vector(descriptions: Sequence[str]) -> str:
    """Combine the descriptions of a vector's elements: "force along x", "force along y" to "force along x, y".

    The words that all have in common stand once, the others as a list, or not at all where there are more than four.
    """
    texts = [text.split(" ") for text in dict.fromkeys(descriptions)]
    if len(texts) == 1:
        return descriptions[0]
    shortest = min(map(len, texts))
    head = next((k for k in range(shortest) if len({words[k] for words in texts}) > 1), shortest)
    tail = next((k for k in range(shortest - head) if len({words[-1 - k] for words in texts}) > 1), shortest - head)
    own = list(dict.fromkeys(" ".join(words[head : len(words) - tail]) for words in texts))
    common = [
        *texts[0][:head],
        *([", ".join(own)] if len(own) <= _MAX_LISTED else []),
        *texts[0][len(texts[0]) - tail :],
    ]
    return " ".join(common) if head + tail else descriptions[0]


def _dimension(size: int, first: int) -> str:
    return f"index{size}" if first == 1 else f"index{size}_from{first}"


def _typed(values: np.ndarray, variable: Variable) -> np.ndarray:
    """Return numbers as values of the variable's type."""
    if variable.type == "String":
        texts = np.empty(values.size, dtype=object)
        texts[:] = [text_of(number) for number in values.flat]
        return texts.reshape(values.shape)
    return values.astype(_DTYPES[variable.type], copy=False)


def _attributes(variable: Variable) -> dict[str, Any]:
    attributes: dict[str, Any] = {
        "units": variable.unit,
        "long_name": variable.description,
        "causality": variable.causality,
    }
    if variable.items:  # as in the CF conventions
        attributes["flag_values"] = np.array(variable.item_values, dtype=np.int32)
        attributes["flag_meanings"] = " ".join(item.replace(" ", "_") for item in variable.items)
    return attributes


def _indices(content: Mapping[str, LabelledArray]) -> dict[str, LabelledArray]:
    """Return the coordinates of the dimensions that index vectors, which count as the FMUs' own names do."""
    dims = {dim for array in content.values() for dim in array.dims[1:]}
    coordinates = {}
    for dim in dims:
        size, _, first = dim.removeprefix("index").partition("_from")
        start = int(first or 1)
        coordinates[dim] = LabelledArray((dim,), np.arange(start, start + int(size)), {"long_name": "index"})
    return coordinates


def scalars(dataset: ResultLike) -> dict[str, tuple[np.ndarray, str]]:
    """Return the scalar name, such as thermal.T[1], -> its values (time,) and unit."""
    columns = {}
    for name, array in dataset.data_vars.items():
        flat = array.to_numpy().reshape(dataset.sizes["time"], -1)
        starts = [int(dataset.coords[d].to_numpy()[0]) if d in dataset.coords else 1 for d in array.dims[1:]]
        for k, index in enumerate(np.ndindex(array.shape[1:])):
            shown = ",".join(str(i + start) for i, start in zip(index, starts, strict=True))
            columns[f"{name}[{shown}]" if index else str(name)] = (flat[:, k], array.attrs.get("units", "1"))
    return columns


def scene_record(scene: Scene, status: str) -> dict[str, Any]:
    """Return the attributes that describe a scene: all that it takes to run it again."""
    return {**_facts(Identity(scene)), "status": status}


@lru_cache(maxsize=16)  # scenes that a process runs again and again
def _facts(same: Identity[Scene]) -> dict[str, Any]:
    scene = same.it
    return {
        "title": scene.title,
        "scene": scene.name,
        "status": "",
        "start_time_s": scene.start_time,
        "stop_time_s": scene.stop_time,
        "coupling": json.dumps(asdict(scene.coupling)),
        "connections": json.dumps([str(c) for c in scene.connections]),
        "members": json.dumps({m.name: _member_record(m) for m in scene.members}),
        "sources": json.dumps(scene.sources),
        "versions": json.dumps(versions()),
        **({"placement": json.dumps({m: asdict(p) for m, p in scene.placement.items()})} if scene.placement else {}),
    }


def _member_record(member: Member) -> dict[str, Any]:
    """Return the settings of one FMU; choices: the words for the numbers that enumerations have among them."""
    declared = {name: v for name, v in member.archive.variables.items() if v.causality == "parameter"}
    values = {name: member.value(name) for name in declared}
    return {
        "fmu": member.archive.path.name,
        "guid": member.archive.guid,
        "parameters": values,
        "frozen": member.frozen,
        "choices": {name: member.choice(name) for name, v in declared.items() if v.items},
        "units": {name: v.unit for name, v in declared.items() if v.unit != "1"},
        "signals": {name: [type(signal).__name__, vars(signal)] for name, signal in member.signals.items()},
    }


def _log_columns(logs: StepLogs) -> dict[str, np.ndarray]:
    """Return the columns of the coupling's log; the start has no step before it: zeros there."""
    columns = {key: np.concatenate([[0.0], logs.column(key)]) for key in ("step", "residual", "error")}
    columns["sweeps"] = np.concatenate([[0], logs.column("sweeps").astype(int)])
    gain = np.full(len(logs) + 1, np.nan)
    numbers, inverses = logs.inverses()
    if numbers.size:
        is_new = np.ones(len(numbers), dtype=bool)  # steps with one sweep learn nothing of the loop
        is_new[1:] = (inverses[1:] != inverses[:-1]).any(axis=(1, 2))
        gain[1 + numbers] = spectral_radius(inverses[is_new])[np.cumsum(is_new) - 1]
    columns["gain"] = gain
    return columns
