"""Files of results: CSV, and one self-describing NetCDF file."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..files import atomic_write
from .dataset import scalars

__all__ = ["read", "write"]

MAX_NAME = 200  # bytes of a name in a NetCDF file, which allows 256
_NAME = "variable_name"  # attribute with a variable's name, where NetCDF does not allow it


def write(dataset: xr.Dataset, path: Path) -> None:
    """Write CSV or NetCDF by the ending (.csv, .nc); the file appears whole or not at all.

    Raises
    ------
    ValueError
        The ending is another one.
    """
    writers: dict[str, Callable[[xr.Dataset, Path], Any]] = {".csv": _write_csv, ".nc": _write_netcdf}
    if path.suffix not in writers:
        raise ValueError(f"{path}: unknown ending {path.suffix!r}; allowed: {', '.join(writers)}")
    with atomic_write(path) as draft:
        writers[path.suffix](dataset, draft)


def read(path: Path) -> xr.Dataset:
    """Read a NetCDF result, fully into memory."""
    with xr.open_dataset(path, engine="netcdf4") as opened:
        dataset = opened.load()
    names = {name: array.attrs.pop(_NAME) for name, array in dataset.data_vars.items() if _NAME in array.attrs}
    return dataset.rename(names)


def _write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    """Write a NetCDF file.

    Names that it does not allow, such as dy/dt, are written with percent signs (dy%2Fdt); the attribute variable_name
    keeps the true one.
    """
    names = {str(name): _file_name(str(name), k) for k, name in enumerate(dataset.data_vars)}
    changed = {name: written for name, written in names.items() if name != written}
    if changed:
        dataset = dataset.rename(changed)
        for name, written in changed.items():
            dataset[written].attrs = {**dataset[written].attrs, _NAME: name}
    dataset.to_netcdf(path, engine="netcdf4")


def _file_name(name: str, number: int) -> str:
    """Return a name that NetCDF takes: no slash, no control characters, no blank at its end, at most 256 bytes."""
    safe = "".join(f"%{ord(c):02X}" if c == "/" or ord(c) < 32 or ord(c) == 127 else c for c in name)
    if safe.endswith(" "):
        safe = f"{safe[:-1]}%20"
    return safe if len(safe.encode()) <= MAX_NAME else f"{name.partition('.')[0][:40]}.variable{number}"


def _write_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write comment lines with the attributes, a header, and a row for each time."""
    columns = scalars(dataset)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for key, value in dataset.attrs.items():
            file.write(f"# {key}: {' '.join(str(value).splitlines())}\n")
        names = [f"{name} [{unit}]".replace('"', '""') for name, (_, unit) in columns.items()]
        file.write(",".join(["time [s]", *(f'"{name}"' for name in names)]) + "\n")
        values = [dataset["time"].to_numpy(), *(values for values, _ in columns.values())]
        if all(column.dtype.kind in "biuf" for column in values):
            np.savetxt(file, np.column_stack(values).astype(float), fmt="%.17g", delimiter=",")
        else:
            texts = [_texts(column) for column in values]
            csv.writer(file, lineterminator="\n").writerows(zip(*texts, strict=True))


def _texts(values: np.ndarray) -> list[str]:
    """Return the values of a column as a CSV file shows them."""
    numbers = values.dtype.kind in "biuf"
    return [f"{float(value):.17g}" if numbers else str(value) for value in values.tolist()]
