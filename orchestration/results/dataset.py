"""What a run leaves: an xarray Dataset with units, descriptions, settings and versions; CSV and one self-describing
NetCDF file.

Scalars of one vector come as one variable with index dimensions: thermal.T (time, index3), rod.shape.p (time,
index21, index3), indices from 1 on. The coupling log lies on the same time axis: coupling.step [s], sweeps, residual
and error (shares of the nominals), gain."""

from __future__ import annotations

import json
import platform
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import xarray as xr

from ..cosim.acceleration import spectral_radius
from ..cosim.master import StepLog
from ..files import atomic_write
from ..fmi.archive import Variable
from ..scene import Member, Scene

__all__ = ["about", "arrays", "collect", "read", "scalars", "versions", "write"]

_INDEXED = re.compile(r"(.+)\[(\d+(?:,\d+)*)\]")
_LOG = {
    "step": ("s", "length of the macro step that ended here"),
    "sweeps": ("1", "sweeps of the loop in it"),
    "residual": ("1", "last residual of the loop, share of the nominals"),
    "error": ("1", "estimated coupling error, share of the nominals"),
    "gain": ("1", "estimated loop gain: spectral radius of one sweep's error map; nan where nothing is known of it"),
}


def collect(
    scene: Scene,
    recorded: Mapping[str, Sequence[Variable]],
    first: dict[str, np.ndarray],
    logs: Sequence[StepLog],
    status: str,
) -> xr.Dataset:
    """The Dataset of a run. recorded: per member the variables of its rows; first: its rows at the start; status:
    'complete', or why the run ended early."""
    times = np.array([0.0, *(log.time for log in logs)])
    found: dict[str, Any] = {}  # at once, since a Dataset that grows aligns everything in it anew with every variable
    for name, variables in recorded.items():
        rows = np.array([first[name], *(log.record[name] for log in logs)])
        found |= arrays(name, variables, rows)
    for key, column in _log_columns(logs).items():
        unit, text = _LOG[key]
        found[f"coupling.{key}"] = ("time", column, {"units": unit, "long_name": text})
    coordinates = {"time": ("time", times, {"units": "s", "long_name": "time"})}
    return xr.Dataset(found, coordinates | _indices(found), about(scene, status))


def arrays(member: str, variables: Sequence[Variable], rows: np.ndarray) -> dict[str, Any]:
    """Of a member: name -> dimensions, values, attributes; scalars of one vector in one array. rows: (time,
    variable)."""
    groups: dict[str, list[tuple[tuple[int, ...], int]]] = {}
    for k, variable in enumerate(variables):
        match = _INDEXED.fullmatch(variable.name)
        base, index = (match[1], tuple(int(i) for i in match[2].split(","))) if match else (variable.name, ())
        groups.setdefault(base, []).append((index, k))
    found = {}
    for base, elements in groups.items():
        shape = tuple(max(index[d] for index, _ in elements) for d in range(len(elements[0][0])))
        values = np.full((len(rows), *shape), np.nan)
        for index, k in elements:
            place: tuple[Any, ...] = (..., *(i - 1 for i in index))
            values[place] = rows[:, k]
        about = variables[elements[0][1]]
        attributes = {"units": about.unit, "long_name": about.description, "causality": about.causality}
        found[f"{member}.{base}"] = (("time", *(f"index{n}" for n in shape)), values, attributes)
    return found


def _indices(found: dict[str, Any]) -> dict[str, Any]:
    """Coordinates of the dimensions that index vectors: from 1 on, as in the FMUs' own names."""
    dims = {dim for names, *_ in found.values() if names != "time" for dim in names[1:]}
    return {dim: (dim, np.arange(1, int(dim.removeprefix("index")) + 1), {"long_name": "index"}) for dim in dims}


def scalars(dataset: xr.Dataset) -> dict[str, tuple[np.ndarray, str]]:
    """Scalar name, such as thermal.T[1], -> its course (time,) and unit."""
    found = {}
    for name, array in dataset.data_vars.items():
        flat = array.to_numpy().reshape(dataset.sizes["time"], -1)
        for k, index in enumerate(np.ndindex(array.shape[1:])):
            label = f"{name}[{','.join(str(i + 1) for i in index)}]" if index else str(name)
            found[label] = (flat[:, k], array.attrs.get("units", "1"))
    return found


def write(dataset: xr.Dataset, path: Path) -> None:
    """CSV or NetCDF by the ending. The file appears whole or not at all."""
    writers: dict[str, Callable[[xr.Dataset, Path], Any]] = {
        ".csv": _write_csv,
        ".nc": lambda d, p: d.to_netcdf(p, engine="netcdf4"),
    }
    if path.suffix not in writers:
        raise ValueError(f"{path}: unknown ending {path.suffix!r}; allowed: {', '.join(writers)}")
    with atomic_write(path) as draft:
        writers[path.suffix](dataset, draft)


def read(path: Path) -> xr.Dataset:
    """A NetCDF result, fully in memory."""
    with xr.open_dataset(path, engine="netcdf4") as dataset:
        return dataset.load()


def about(scene: Scene, status: str) -> dict[str, Any]:
    """The record of a scene: all that it takes to run it again."""
    return {
        "title": scene.title,
        "scene": scene.name,
        "status": status,
        "stop_time_s": scene.stop_time,
        "coupling": json.dumps(asdict(scene.coupling)),
        "connections": json.dumps([str(c) for c in scene.connections]),
        "members": json.dumps({m.name: _member(m) for m in scene.members}),
        "sources": json.dumps(scene.sources),
        "versions": json.dumps(versions()),
    }


def _member(m: Member) -> dict[str, Any]:
    """choices: the words for the numbers that enumerations have among the parameters."""
    parameters = {v: about for v, about in m.archive.variables.items() if about.causality == "parameter"}
    values = {v: m.value(v) for v in parameters}
    return {
        "fmu": m.archive.path.name,
        "guid": m.archive.guid,
        "parameters": values,
        "frozen": m.frozen,
        "choices": {v: m.choice(v) for v, about in parameters.items() if about.items},
        "units": {v: about.unit for v, about in parameters.items() if about.unit != "1"},
        "signals": {name: [type(signal).__name__, vars(signal)] for name, signal in m.signals.items()},
    }


def versions() -> dict[str, str]:
    """Of what a result came from."""
    try:
        own = version("tca-cosim")
    except PackageNotFoundError:  # run from a source tree that is not installed
        own = "not installed"
    return {"tca-cosim": own, "fmpy": fmpy.__version__, "python": platform.python_version(), "numpy": np.__version__}


def _log_columns(logs: Sequence[StepLog]) -> dict[str, np.ndarray]:
    """The start has no step before it: zeros there."""
    columns = {key: np.array([0.0, *(getattr(log, key) for log in logs)]) for key in ("step", "residual", "error")}
    columns["sweeps"] = np.array([0, *(log.sweeps for log in logs)])
    gain = np.full(len(logs) + 1, np.nan)
    known = [k for k, log in enumerate(logs) if log.inverse is not None]
    if known:
        gain[[k + 1 for k in known]] = spectral_radius(np.array([logs[k].inverse for k in known]))
    columns["gain"] = gain
    return columns


def _write_csv(dataset: xr.Dataset, path: Path) -> None:
    columns = scalars(dataset)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for key, value in dataset.attrs.items():
            file.write(f"# {key}: {value}\n")
        file.write(",".join(["time [s]", *(f'"{name} [{unit}]"' for name, (_, unit) in columns.items())]) + "\n")
        table = np.column_stack([dataset["time"].to_numpy(), *(values for values, _ in columns.values())])
        np.savetxt(file, table, fmt="%.17g", delimiter=",")
