"""Signals from columns of CSV and NetCDF files.

    V = { table = { file = "volts.csv", column = "V1", time = "t", interpolation = "linear" } }

Values are joined by straight lines (linear) or held. Of two rows of one time the first ends a line and the second
begins the next: the signal jumps there. In a CSV file the first row that is not a comment (#) has the names; a unit may
follow in brackets: V1 [mV]. The first column is the time unless `time` names another.
"""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..cosim.signals import Ramps, Signal, Steps
from ..fmi import units
from ..fmi.archive import Variable, similar
from .netcdf_columns import SUFFIXES, read_netcdf

__all__ = ["ENTRIES", "column_names", "column_signal", "convert_column", "read_samples", "repeated"]

ENTRIES = ("file", "column", "time", "interpolation")
_INTERPOLATIONS: Mapping[str, type[Ramps | Steps]] = {"linear": Ramps, "held": Steps}
# A name, which may end with an index as in tip.p[1], and a unit: tip.p[1] [mm].
_HEAD = re.compile(r"\s*([^\[\]]*?(?:\[\d[\d,]*\])?)\s*(?:\[([^\[\]]*)\])?\s*")
_TIME = Variable("time", 0, "Real", "local", "fixed", "", "s", {"s": 1})
MAX_ROWS = 1_000_000  # of a table: each row of a linear one is an event at which a macro step ends


def column_signal(content: Any, folder: Path, variable: Variable, is_short: bool = False) -> Signal:
    """Read a signal for a variable.

    Parameters
    ----------
    content
        The table, with entries of ENTRIES.
    folder
        Folder that relative files start from.
    variable
        What the signal drives.
    is_short
        Whether the scene has the short form, whose entries messages name: hold instead of table.interpolation.

    Raises
    ------
    ValueError
        With problem and remedy.
    """

    def entry(name: str) -> str:
        return {"interpolation": "hold"}.get(name, name) if is_short else f"table.{name}"

    if not isinstance(content, Mapping) or "file" not in content:
        raise ValueError(f"give table as {{ file = 'volts.csv', column = 'V1' }}; allowed: {', '.join(ENTRIES)}")
    for key, value in content.items():
        if key not in ENTRIES:
            raise ValueError(f"{entry(key)}: unknown; {similar(str(key), [entry(n) for n in ENTRIES])}")
        if not isinstance(value, str):
            raise ValueError(f"{entry(key)} = {value!r}: wrong type; give a text")
    kind = content.get("interpolation", "linear")
    if kind not in _INTERPOLATIONS:
        raise ValueError(f"{entry('interpolation')} = {kind!r}: {similar(kind, _INTERPOLATIONS)}")
    path = folder / content["file"]
    names, stated, columns = _read(path, _modified(path), content.get("time") if _is_netcdf(path) else None)
    time = _index(content.get("time", names[0]), names, entry("time"), path)
    if "column" not in content and len(names) > 2:
        raise ValueError(f"table without column; allowed: {', '.join(name for name in names if name != names[time])}")
    column = _index(content.get("column", names[1] if len(names) > 1 else names[0]), names, entry("column"), path)
    times = convert_column(_finite(columns[time], names[time], path), stated[time], _TIME, path)
    values = convert_column(_finite(columns[column], names[column], path), stated[column], variable, path)
    _require_order(times, kind == "linear", path)
    for value in values:
        if not variable.least <= value <= variable.most:
            raise ValueError(f"{path}: {value:g} is out of range; allowed: {variable.least:g} to {variable.most:g}")
    return _INTERPOLATIONS[kind](tuple(times), tuple(values))


def _is_netcdf(path: Path) -> bool:
    return path.suffix.lower() in SUFFIXES


def _finite(column: Sequence[float], name: str, path: Path) -> list[float]:
    """Return the numbers of a column. Raises ValueError where one is missing or not finite."""
    numbers = list(map(float, column))
    bad = next((k for k, number in enumerate(numbers, 1) if not math.isfinite(number)), None)
    if bad is not None:
        raise ValueError(f"{path}: row {bad}: {name!r} is not finite, or missing; correct it")
    return numbers


def _require_order(times: Sequence[float], may_jump: bool, path: Path) -> None:
    """Refuse times that fall, or that occur more often than a jump needs."""
    gaps = [b - a for a, b in itertools.pairwise(times)]
    repeats = [gap == 0.0 for gap in gaps]
    if any(gap < 0.0 for gap in gaps) or (any(repeats) and not may_jump):
        raise ValueError(f"{path}: times must increase; sort the rows, one for each time")
    if any(a and b for a, b in itertools.pairwise(repeats)):
        raise ValueError(f"{path}: three rows of one time; give two, before and behind the jump")


def split_head(cell: str) -> tuple[str, str]:
    """Split the head of a column: 'tip.p[1] [mm]' -> ('tip.p[1]', 'mm'); the unit is '' where there is none."""
    match = _HEAD.fullmatch(cell)
    return (match[1], match[2] or "") if match else ("", "")


def read_samples(path: Path) -> tuple[list[tuple[str, str]], list[list[float]]]:
    """Read a CSV or NetCDF file of samples over time; the time comes first, empty cells are missing samples.

    Returns
    -------
    tuple
        Name and unit ('' where none) of each column, and the columns: times [s], values in those units, nan where
        missing.

    Raises
    ------
    ValueError
        With problem and remedy.
    """
    if _is_netcdf(path):
        names, stated, columns = _read(path, _modified(path))
        times, *values = [list(map(float, column)) for column in columns]
        return list(zip(names, stated, strict=True)), [convert_column(times, stated[0], _TIME, path), *values]
    try:
        lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    except OSError as error:
        raise ValueError(f"{path}: {(error.strerror or 'not found').lower()}; check the path") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a text in UTF-8; save the file as UTF-8") from error
    lines = [line for line in lines if not line.startswith("#")]
    if len(lines) < 2:
        raise ValueError(f"{path}: no rows; give a line of names and at least one row of numbers")
    head, *rows = _cells(lines, path)
    heads = [split_head(cell) for cell in head]
    twice = repeated([name for name, _ in heads])
    if twice is not None:
        raise ValueError(f"{path}: two columns {twice!r}; keep one of them")
    table = []
    for number, row in enumerate(rows, 1):
        if len(row) != len(heads):
            raise ValueError(f"{path}: row {number}: {len(row)} cells for {len(heads)} names; leave cells empty")
        try:
            table.append([float(cell) if cell.strip() else math.nan for cell in row])
        except ValueError as error:
            raise ValueError(
                f"{path}: row {number}: {error}; give numbers with a point, or leave cells empty"
            ) from error
    times, *values = [list(column) for column in zip(*table, strict=True)]
    return heads, [convert_column(times, heads[0][1], _TIME, path), *values]


def _cells(lines: Sequence[str], path: Path) -> list[list[str]]:
    """Split lines into cells. Raises ValueError where they are no table."""
    try:
        return list(csv.reader(lines, delimiter=_delimiter(lines[0])))
    except csv.Error as error:
        raise ValueError(f"{path}: no table ({error}); check its quotes and separators") from error


def _delimiter(line: str) -> str:
    """Return what separates the cells of a line: a tab, a semicolon or a comma."""
    return next((d for d in ("\t", ";", ",") if d in line), ",")


def repeated(names: Sequence[str]) -> str | None:
    """Return the first name that is there twice."""
    return next((name for k, name in enumerate(names) if name in names[:k]), None)


def column_names(path: Path) -> list[str]:
    """Return the names of a file's columns, without units. Raises ValueError with problem and remedy."""
    return list(_read(path, _modified(path))[0])


def _modified(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError as error:
        raise ValueError(f"{path}: {(error.strerror or 'not found').lower()}; check the path of the table") from error


@lru_cache(maxsize=8)
def _read(path: Path, modified: int, time: str | None = None) -> tuple[list[str], list[str], Sequence[Sequence[float]]]:
    """Names, units ('' where none) and columns of a file; time: its name in a NetCDF file."""
    if _is_netcdf(path):
        heads, units, columns = read_netcdf(path, time)
        _require_few(len(columns[0]), path)
        return heads, units, columns
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ValueError(f"{path}: {(error.strerror or 'not found').lower()}; check the path") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a text in UTF-8; save the file as UTF-8") from error
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise ValueError(f"{path}: no rows; give a line of names and at least one row of numbers")
    _require_few(len(lines), path)
    head, *body = _cells(lines, path)
    names, stated = [split_head(cell)[0] for cell in head], [split_head(cell)[1] for cell in head]
    rows = []
    for number, row in enumerate(body, 1):
        try:
            rows.append([float(cell) for cell in row])
        except ValueError as error:
            raise ValueError(f"{path}: row {number}: {error}; give numbers with a point") from error
        if len(row) != len(names):
            raise ValueError(f"{path}: row {number}: {len(row)} cells for {len(names)} names; give one for each")
        if not all(map(math.isfinite, rows[-1])):
            raise ValueError(f"{path}: row {number}: not finite; give finite numbers")
    return names, stated, list(zip(*rows, strict=True))


def _require_few(rows: int, path: Path) -> None:
    if rows > MAX_ROWS:
        raise ValueError(f"{path}: more than {MAX_ROWS} rows; sample it more coarsely")


def _index(name: str, names: list[str], what: str, path: Path) -> int:
    if name not in names:
        raise ValueError(f"{what} = {name!r}: no such column in {path}; {similar(name, names)}")
    if names.count(name) > 1:
        raise ValueError(f"{what} = {name!r}: {path} has two columns of that name; rename one")
    return names.index(name)


def convert_column(values: list[float], unit: str, variable: Variable, path: Path) -> list[float]:
    """Return the values of a column in the variable's unit. Raises ValueError where its unit does not fit."""
    if not unit or unit == variable.unit:
        return values
    dimension = variable.dimension if variable.has_unit else {}
    how = (dimension, variable.unit, variable.relative, variable.factor, variable.offset)
    try:
        zero, one = (units.convert(f"{number} {unit}", *how) for number in (0.0, 1.0))
    except ValueError as error:
        raise ValueError(f"{path}: {error}; give a unit that converts to {variable.unit!r}") from error
    return [zero + (one - zero) * value for value in values]
