"""What of a result can be drawn as a body: its courses and dimensions, found by what the members' variables are called,
whatever the members are."""

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
    "manipulator",
    "members",
    "moments",
    "of_heat",
    "of_rod",
    "recorded_parameters",
    "thermal_parameters",
]

ZERO_CELSIUS = 273.15  # [K]
STATIONS = 31  # cross-sections that are drawn
_DRAWN = (*SHAPE_OUTPUTS, TEMPERATURE)
_SLIM = 0.17  # radius of a TCA, share of the body's, where no heat model says it: that of the paper


@dataclass(frozen=True)
class Manipulator:
    """times (time,) [s]; temperature (time, N) of the TCAs [K]; lengths in m, angles in rad."""

    times: np.ndarray
    frames: Frames
    temperature: np.ndarray
    length: float
    radius: float
    tca_radius: float
    offset: float
    azimuth: np.ndarray  # (N,)
    helix: np.ndarray  # (N,) [rad/m]

    @cached_property
    def body(self) -> Surface:
        return tube(np.zeros((STATIONS, 2)), self.radius, 32)

    @cached_property
    def tcas(self) -> tuple[Surface, ...]:
        return tuple(tube(self.route(i), self.tca_radius, 14) for i in range(self.azimuth.size))

    def route(self, tca: int) -> np.ndarray:
        """(STATIONS, 2) [m]: where the axis of a TCA runs in the cross-sections."""
        angle = self.azimuth[tca] + self.helix[tca] * np.linspace(0.0, self.length, STATIONS)
        return self.offset * np.column_stack([np.cos(angle), np.sin(angle)])


def members(result: xr.Dataset) -> Mapping[str, Any]:
    """By name: fmu, guid, parameters, signals (results.scene_record)."""
    return json.loads(result.attrs.get("members", "{}"))


def of_heat(result: xr.Dataset) -> str | None:
    """The member that is a heat model of a cross-section."""
    return next((m for m in members(result) if {f"{m}.V", f"{m}.T", f"{m}.T_surface"} <= set(result.data_vars)), None)


def of_rod(result: xr.Dataset) -> str | None:
    """The member that is a rod whose shape is known."""
    return next((m for m in members(result) if {f"{m}.{name}" for name in _DRAWN} <= set(result.data_vars)), None)


def moments(result: xr.Dataset, most: int) -> np.ndarray:
    """Rows of a result, at most that many, evenly spread in time, first and last among them."""
    times = result["time"].to_numpy()
    if times.size <= most:
        return np.arange(times.size)
    wanted = np.linspace(times[0], times[-1], most)
    after = np.searchsorted(times, wanted).clip(1, times.size - 1)
    return np.unique(np.where(wanted - times[after - 1] < times[after] - wanted, after - 1, after))


def manipulator(result: xr.Dataset, rows: np.ndarray) -> Manipulator:
    """At those rows of the result. CosimError where it holds no body's shape."""
    rod = of_rod(result)
    if rod is None:
        raise CosimError(
            f"result {result.attrs.get('scene', '')!r} has no shape to draw: no member with {', '.join(_DRAWN)}; "
            "run a scene with rod.fmu"
        )
    geometry, heat = Geometry.of(recorded_parameters(result, rod)), of_heat(result)
    shape, tip, temperature = (result[f"{rod}.{name}"].to_numpy()[rows] for name in _DRAWN)
    return Manipulator(
        times=result["time"].to_numpy()[rows],
        frames=frames(shape, tip, STATIONS),
        temperature=temperature,
        length=geometry.length,
        radius=geometry.radius,
        tca_radius=thermal_parameters(result, heat).outer_radius if heat else _SLIM * geometry.radius,
        offset=geometry.offset,
        azimuth=np.array(geometry.azimuth),
        helix=np.array(recorded_parameters(result, rod).reals("tca.helix")),
    )


def recorded_parameters(result: xr.Dataset, member: str) -> RecordedParameters:
    """Parameters of a member as the result records them."""
    record = members(result)[member]
    return RecordedParameters(record["parameters"], record["choices"])


def thermal_parameters(result: xr.Dataset, heat: str) -> ThermalParameters:
    """Parameters of the member that is the heat model."""
    return ThermalParameters.of(recorded_parameters(result, heat))
