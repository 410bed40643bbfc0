"""A result as plain arrays: the part of xarray's interface that writing and summaries use.

Loading xarray takes longer than a run from the command line, so that a Dataset is made where one is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["LabelledArray", "ResultLike", "ResultTable"]


class ArrayLike(Protocol):
    """What LabelledArray and xarray.DataArray have in common here."""

    @property
    def attrs(self) -> Any:
        """Attributes by name."""

    @property
    def dims(self) -> tuple[Any, ...]:
        """Names of the dimensions."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of elements along them."""

    @property
    def dtype(self) -> Any:
        """Type of the elements."""

    def to_numpy(self) -> np.ndarray:
        """Return the values."""


class ResultLike(Protocol):
    """What ResultTable and xarray.Dataset have in common here."""

    @property
    def attrs(self) -> Any:
        """Attributes by name."""

    @property
    def data_vars(self) -> Mapping[Any, Any]:
        """Variables by name."""

    @property
    def coords(self) -> Mapping[Any, Any]:
        """Coordinates by name."""

    @property
    def sizes(self) -> Mapping[Any, int]:
        """Numbers of elements by dimension."""

    def __contains__(self, name: object, /) -> bool:
        """Whether there is a variable or coordinate of that name."""

    def __getitem__(self, name: str, /) -> Any:
        """Return a variable or coordinate."""


@dataclass(eq=False)
class LabelledArray:
    """Values with names of their dimensions and attributes."""

    dims: tuple[str, ...]
    values: np.ndarray
    attrs: dict[str, Any]

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of elements along the dimensions."""
        return self.values.shape

    @property
    def dtype(self) -> Any:
        """Type of the elements."""
        return self.values.dtype

    def to_numpy(self) -> np.ndarray:
        """Return the values."""
        return self.values


@dataclass(eq=False)
class ResultTable:
    """Variables and coordinates by name, and attributes of the whole."""

    data_vars: dict[str, LabelledArray]
    coords: dict[str, LabelledArray]
    attrs: dict[str, Any] = field(default_factory=dict)

    @property
    def sizes(self) -> dict[str, int]:
        """Numbers of elements by dimension."""
        arrays = (*self.coords.values(), *self.data_vars.values())
        return {dim: size for array in arrays for dim, size in zip(array.dims, array.shape, strict=True)}

    def __contains__(self, name: object) -> bool:
        return name in self.data_vars or name in self.coords

    def __getitem__(self, name: str) -> LabelledArray:
        return self.data_vars[name] if name in self.data_vars else self.coords[name]

    def to_xarray(self) -> xr.Dataset:
        """Return the Dataset of the same content."""
        coordinates = tuple((name, a.dims, a.dtype.str, a.values.tobytes()) for name, a in self.coords.items())
        shapes = tuple((name, array.dims, array.shape) for name, array in self.data_vars.items())
        dataset = _empty_dataset(coordinates, shapes).copy()
        variables = dataset.variables
        for name, array in self.data_vars.items():
            variables[name].data = array.values
        for name, array in (*self.coords.items(), *self.data_vars.items()):
            variables[name].attrs = array.attrs
        dataset.attrs = self.attrs
        return dataset


@lru_cache(maxsize=8)  # an empty one is copied in a third of the time that a new one takes
def _empty_dataset(
    coordinates: tuple[tuple[str, tuple[str, ...], str, bytes], ...],
    shapes: tuple[tuple[str, tuple[str, ...], tuple[int, ...]], ...],
) -> xr.Dataset:
    """Return a Dataset with these coordinates (name, dimensions, type, content) and variables without values."""
    import xarray as xr

    variables = {name: (dims, np.broadcast_to(0.0, shape)) for name, dims, shape in shapes}
    return xr.Dataset(
        variables, {name: (dims, np.frombuffer(content, kind)) for name, dims, kind, content in coordinates}
    )
