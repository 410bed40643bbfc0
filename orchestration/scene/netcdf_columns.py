"""Columns of a NetCDF file: the variables along its time, each element of a vector as a column of its own."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["SUFFIXES", "read_netcdf"]

SUFFIXES = (".nc", ".nc4", ".cdf")
_NAME = "variable_name"  # attribute with the true name of a variable, in results of this package
_MAX_COLUMNS = 100_000


def read_netcdf(path: Path, time: str | None = None) -> tuple[list[str], list[str], list[list[float]]]:
    """Read the columns of a NetCDF file.

    Parameters
    ----------
    path : Path
        The file. Its variables may lie in results of this package: thermal.T with dimensions (time, index3) has the
        columns thermal.T[1] to thermal.T[3].
    time : str, optional
        Name of the time; default: time, t, or the one variable that is named as its dimension.

    Returns
    -------
    tuple
        Names, units ('' where none), and columns (rows,); the time comes first.

    Raises
    ------
    ValueError
        With problem and remedy.
    """
    import netCDF4

    try:
        file = netCDF4.Dataset(path)
    except OSError as error:
        raise ValueError(f"{path}: not a readable NetCDF file ({error}); check the path") from error
    with file:
        file.set_auto_maskandscale(True)
        clock = _time(file, time, path)
        along = clock.dimensions[0]
        columns = [(str(time or clock.name), _unit(clock), _numbers(clock[...]))]
        for variable in file.variables.values():
            if variable is not clock and variable.dimensions[:1] == (along,) and np.dtype(variable.dtype).kind in "iuf":
                columns += _elements(variable)
    if len(columns) > _MAX_COLUMNS:
        raise ValueError(f"{path}: more than {_MAX_COLUMNS} columns; keep those that are wanted")
    names, units, values = zip(*columns, strict=True)
    return list(names), list(units), [column.tolist() for column in values]


def _time(file: Any, name: str | None, path: Path) -> Any:
    """Find the variable that is the time."""
    known = [v for v in file.variables.values() if v.ndim == 1 and np.dtype(v.dtype).kind in "iuf"]
    wanted = [name] if name else ["time", "t"]
    for variable in known:
        if variable.name in wanted:
            return variable
    alone = [v for v in known if v.name == v.dimensions[0]]
    if name is None and len(alone) == 1:
        return alone[0]
    raise ValueError(f"{path}: no time {name or ''!r}; it has {', '.join(v.name for v in known) or 'no vector'}")


def _elements(variable: Any) -> Iterator[tuple[str, str, np.ndarray]]:
    name = str(getattr(variable, _NAME, variable.name))
    values = _numbers(variable[...])
    if values.ndim == 1:
        yield name, _unit(variable), values
        return
    firsts = [0 if str(d).endswith("_from0") else 1 for d in variable.dimensions[1:]]
    places = itertools.product(*map(range, values.shape[1:]))
    for index, column in zip(places, values.reshape(len(values), -1).T, strict=True):
        shown = ",".join(str(i + first) for i, first in zip(index, firsts, strict=True))
        yield f"{name}[{shown}]", _unit(variable), column


def _unit(variable: Any) -> str:
    unit = str(getattr(variable, "units", ""))
    return "" if unit == "1" or " since " in unit else unit


def _numbers(values: Any) -> np.ndarray:
    """Numbers, nan where the file has none."""
    return np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)
