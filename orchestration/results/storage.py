"""Files of results: CSV, and one self-describing NetCDF file."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files import atomic_write
from .dataset import scalars
from .table import ResultLike, ResultTable

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read", "write"]

MAX_BLOCK = 100_000  # numbers of a CSV file that are made text at once: about 2 MB
MAX_NAME = 200  # bytes of a name in a NetCDF file, which allows 256
_NAME = "variable_name"  # attribute with a variable's name, where NetCDF does not allow it


def write(dataset: ResultLike, path: Path) -> None:
    """Write CSV or NetCDF by the ending (.csv, .nc); the file appears whole or not at all.

    Raises
    ------
    ValueError
        The ending is another one.
    """
    writers: dict[str, Callable[[Any, Path], Any]] = {".csv": _write_csv, ".nc": _write_netcdf}
    if path.suffix not in writers:
        raise ValueError(f"{path}: unknown ending {path.suffix!r}; allowed: {', '.join(writers)}")
    with atomic_write(path) as draft:
        writers[path.suffix](dataset, draft)


def read(path: Path) -> xr.Dataset:
    """Read a NetCDF result, fully into memory."""
    import xarray as xr

    with xr.open_dataset(path, engine="netcdf4") as opened:
        dataset = opened.load()
    names = {name: array.attrs.pop(_NAME) for name, array in dataset.data_vars.items() if _NAME in array.attrs}
    return dataset.rename(names)


def _write_netcdf(dataset: xr.Dataset | ResultTable, path: Path) -> None:
    """Write a NetCDF file.

    Names that it does not allow, such as dy/dt, are written with percent signs (dy%2Fdt); the attribute variable_name
    keeps the true one.
    """
    names = {str(name): _file_name(str(name), k) for k, name in enumerate(dataset.data_vars)}
    if isinstance(dataset, ResultTable):
        _write_table(dataset, names, path)
        return
    changed = {name: written for name, written in names.items() if name != written}
    if changed:
        dataset = dataset.rename(changed)
        for name, written in changed.items():
            dataset[written].attrs = {**dataset[written].attrs, _NAME: name}
    dataset.to_netcdf(path, engine="netcdf4")


def _write_table(table: ResultTable, names: dict[str, str], path: Path) -> None:
    """Write a table as xarray writes a Dataset of the same content."""
    import netCDF4

    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        file.set_fill_off()
        file.set_auto_maskandscale(False)
        file.setncatts(table.attrs)
        for dim, size in table.sizes.items():
            file.createDimension(dim, size)
        for name, array in {**table.data_vars, **table.coords}.items():
            written, values, attributes = names.get(name, name), array.values, dict(array.attrs)
            if written != name:
                attributes[_NAME] = name
            kind: Any = str if values.dtype == object else values.dtype
            if values.dtype == bool:
                kind, values, attributes = np.int8, values.astype(np.int8), {**attributes, "dtype": "bool"}
            fill = np.nan if values.dtype.kind == "f" else None
            variable = file.createVariable(written, kind, array.dims, fill_value=fill)
            variable.setncatts(attributes)
            variable[...] = values


def _file_name(name: str, number: int) -> str:
    """Return a name that NetCDF takes: no slash, no control characters, no blank at its end, at most 256 bytes."""
    safe = "".join(f"%{ord(c):02X}" if c == "/" or ord(c) < 32 or ord(c) == 127 else c for c in name)
    if safe.endswith(" "):
        safe = f"{safe[:-1]}%20"
    return safe if len(safe.encode()) <= MAX_NAME else f"{name.partition('.')[0][:40]}.variable{number}"


def _write_csv(dataset: ResultLike, path: Path) -> None:
    """Write comment lines with the attributes, a header, and a row for each time."""
    columns = scalars(dataset)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for key, value in dataset.attrs.items():
            file.write(f"# {key}: {' '.join(str(value).splitlines())}\n")
        names = [f"{name} [{unit}]".replace('"', '""') for name, (_, unit) in columns.items()]
        file.write(",".join(["time [s]", *(f'"{name}"' for name in names)]) + "\n")
        values = [dataset["time"].to_numpy(), *(values for values, _ in columns.values())]
        if all(column.dtype.kind in "biuf" for column in values):
            rows = np.column_stack(values).astype(float)
            line = ",".join(["%.17g"] * rows.shape[1]) + "\n"
            for block in np.array_split(rows, max(1, rows.size // MAX_BLOCK)):
                file.write(line * len(block) % tuple(block.ravel().tolist()))
        else:
            texts = [_texts(column) for column in values]
            csv.writer(file, lineterminator="\n").writerows(zip(*texts, strict=True))


def _texts(values: np.ndarray) -> list[str]:
    """Return the values of a column as a CSV file shows them."""
    numbers = values.dtype.kind in "biuf"
    return [f"{float(value):.17g}" if numbers else str(value) for value in values.tolist()]
