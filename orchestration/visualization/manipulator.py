"""Shape of the manipulator over time, from a result.

Members are recognised by the names of their variables, whatever the members themselves are called."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from ..errors import CosimError
from ..scene.manipulator import SHAPE_OUTPUTS, TEMPERATURE, Geometry, RecordedParameters, ThermalParameters
from .geometry import Frames, Surface, frames, tube

__all__ = [
    "ZERO_CELSIUS",
    "Manipulator",
    "heat_member",
    "manipulator",
    "members",
    "recorded_parameters",
    "rod_member",
    "select_rows",
    "thermal_parameters",
]

ZERO_CELSIUS = 273.15  # [K]
STATIONS = 31  # number of cross-sections that are drawn
_NEEDED = (*SHAPE_OUTPUTS, TEMPERATURE)
_TCA_RADIUS = 0.17  # radius of a TCA as a fraction of the body's, where no heat model gives it: the paper's


@dataclass(frozen=True)
class Manipulator:
    """Shape over time and dimensions of a body with N TCAs; lengths in m, angles in rad."""

    times: np.ndarray  # (time,) [s]
    frames: Frames
    temperature: np.ndarray  # of the TCAs, (time, N) [K]
    gravity: np.ndarray  # (time, 3) [m/s2]
    length: float
    radius: float
    tca_radius: tuple[float, ...]
    offset: tuple[float, ...]
    azimuth: np.ndarray  # (N,)
    helix: np.ndarray  # (N,) [rad/m]

    @cached_property
    def body(self) -> Surface:
        """Surface of the body."""
        return tube(np.zeros((STATIONS, 2)), self.radius, 32)

    @cached_property
    def tcas(self) -> tuple[Surface, ...]:
        """Surfaces of the TCAs."""
        return tuple(tube(self.route(i), self.tca_radius[i], 14) for i in range(self.azimuth.size))

    def route(self, tca: int) -> np.ndarray:
        """Positions of the axis of a TCA in the cross-sections [m], (STATIONS, 2)."""
        angle = self.azimuth[tca] + self.helix[tca] * np.linspace(0.0, self.length, STATIONS)
        return self.offset[tca] * np.column_stack([np.cos(angle), np.sin(angle)])


def members(result: xr.Dataset) -> Mapping[str, Any]:
    """Records of the members by name: fmu, guid, parameters, signals."""
    return json.loads(result.attrs.get("members", "{}"))


def heat_member(result: xr.Dataset) -> str | None:
    """Name of the member that is a heat model of a cross-section."""
    return next((m for m in members(result) if {f"{m}.V", f"{m}.T", f"{m}.T_surface"} <= set(result.data_vars)), None)


def rod_member(result: xr.Dataset) -> str | None:
    """Name of the member that is a rod whose shape is known."""
    return next((m for m in members(result) if {f"{m}.{name}" for name in _NEEDED} <= set(result.data_vars)), None)


def select_rows(result: xr.Dataset, most: int) -> np.ndarray:
    """Choose at most `most` rows of a result, evenly spaced in time, the first and the last included."""
    times = result["time"].to_numpy()
    if times.size <= most:
        return np.arange(times.size)
    even = np.linspace(times[0], times[-1], most)
    after = np.searchsorted(times, even).clip(1, times.size - 1)
    return np.unique(np.where(even - times[after - 1] < times[after] - even, after - 1, after))


def manipulator(result: xr.Dataset, rows: np.ndarray) -> Manipulator:
    """Shape at some rows of a result. CosimError where it contains no rod."""
    rod = rod_member(result)
    if rod is None:
        raise CosimError(
            f"result {result.attrs.get('scene', '')!r} has no shape to draw: no member with {', '.join(_NEEDED)}; "
            "run a scene with rod.fmu"
        )
    geometry, heat = Geometry.of(recorded_parameters(result, rod)), heat_member(result)
    shape, tip, temperature = (result[f"{rod}.{name}"].to_numpy()[rows] for name in _NEEDED)
    return Manipulator(
        times=result["time"].to_numpy()[rows],
        frames=frames(shape, tip, STATIONS),
        temperature=temperature,
        gravity=_gravity(result, rod)[rows],
        length=geometry.length,
        radius=geometry.radius,
        tca_radius=thermal_parameters(result, heat).outer_radius
        if heat
        else (_TCA_RADIUS * geometry.radius,) * len(geometry.azimuth),
        offset=geometry.offset,
        azimuth=np.array(geometry.azimuth),
        helix=np.array(recorded_parameters(result, rod).reals("tca.helix")),
    )


def _gravity(result: xr.Dataset, rod: str) -> np.ndarray:
    """Gravity (time, 3) [m/s2]; zero where the rod has no such input."""
    name = f"{rod}.gravity"
    return result[name].to_numpy() if name in result else np.zeros((result.sizes["time"], 3))


def recorded_parameters(result: xr.Dataset, member: str) -> RecordedParameters:
    """Parameters of a member as the result records them."""
    record = members(result)[member]
    return RecordedParameters(record["parameters"], record["choices"])


def thermal_parameters(result: xr.Dataset, heat: str) -> ThermalParameters:
    """Parameters of the member that is the heat model."""
    return ThermalParameters.of(recorded_parameters(result, heat))
