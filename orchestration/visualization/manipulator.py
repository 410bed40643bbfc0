"""Shape of the manipulator over time, from a result.

Members are recognised by the names of their variables, whatever the members themselves are called.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from scipy.spatial.transform import Rotation

from ..errors import CosimError
from ..scene.body import RodParameters
from ..scene.manipulator import SHAPE_OUTPUTS, TEMPERATURE, RecordedParameters, ThermalParameters
from .geometry import Frames, Surface, frames, tube

__all__ = [
    "ZERO_CELSIUS",
    "Manipulator",
    "Payload",
    "heat_members",
    "manipulator",
    "members",
    "recorded_parameters",
    "rod_member",
    "rod_members",
    "section_member",
    "section_rod",
    "select_rows",
    "thermal_parameters",
]

ZERO_CELSIUS = 273.15  # [K]
STATIONS = 31  # number of cross-sections of a body of one segment that are drawn; others have two more at each break
_NEEDED = (*SHAPE_OUTPUTS, TEMPERATURE)
_TCA_RADIUS = 0.17  # radius of a TCA as a fraction of the body's, where no heat model gives it: the paper's
# A wire from a heat model to the rod, alone or as a term of a sum (Connection.__str__).
_HEAT_WIRE = re.compile(r"(?P<heat>.+)\.T\[(?P<of>\d+)\][^>]*-> (?P<rod>.+)\.T\[(?P<to>\d+)\]( \(term .*\))?")
_BALL_DENSITY = 8e3  # [kg/m3] of the ball that stands for a body at the tip: steel, where its centre leaves room


@dataclass(frozen=True)
class Payload:
    """Body at the tip, drawn as a ball."""

    mass: float  # [kg]
    radius: float  # [m]
    centre: np.ndarray  # (time, 3) [m]


@dataclass(frozen=True)
class Manipulator:
    """Shape over time and dimensions of a body with N TCAs; lengths in m, angles in rad.

    Positions and directions are those of the picture: the rod's own, turned about z and moved where it is placed.
    """

    name: str
    times: np.ndarray  # (time,) [s]
    frames: Frames
    stations: np.ndarray  # where the cross-sections are along the straight body (n,) [m]
    temperature: np.ndarray  # of the TCAs, (time, N) [K]
    gravity: np.ndarray  # (time, 3) [m/s2]
    body_parameters: RodParameters
    tca_radius: tuple[float, ...]
    payload: Payload | None

    def moved(self, position: np.ndarray, turn: float) -> Manipulator:
        """Return the manipulator turned about z by an angle [rad] and moved by a vector (3,) [m]."""
        rotation = Rotation.from_euler("z", turn).as_matrix().T
        p, d1, d2 = (vectors @ rotation for vectors in (self.frames.p, self.frames.d1, self.frames.d2))
        payload = self.payload and replace(self.payload, centre=self.payload.centre @ rotation + position)
        gravity = self.gravity @ rotation
        return replace(self, frames=Frames(p + position, d1, d2), payload=payload, gravity=gravity)

    @property
    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates [m] of the body and what it carries over time, (3,) each."""
        points = [self.frames.sweep(self.body.offsets, self.body.stations).reshape(-1, 3)]
        if self.payload:
            reach = self.payload.radius * np.vstack([np.eye(3), -np.eye(3)])
            points.append((self.payload.centre[:, None] + reach).reshape(-1, 3))
        together = np.concatenate(points)
        return together.min(axis=0), together.max(axis=0)

    @property
    def length(self) -> float:
        """Length of the straight body."""
        return self.body_parameters.length

    @cached_property
    def radii(self) -> np.ndarray:
        """Radii of the cross-sections (n,); the two at a break between segments have those of their own segments."""
        p = self.body_parameters
        breaks = p.breaks
        radii = np.empty(self.stations.size)
        for j, segment in enumerate(p.segments):
            here = slice(*self.bounds(j + 1, j + 1))
            share = (self.stations[here] - breaks[j]) / segment.length
            radii[here] = segment.radius + (segment.radius_end - segment.radius) * share
        return radii

    def bounds(self, first: int, last: int) -> tuple[int, int]:
        """Indices of the first cross-section of segments first to last (from 1) and of the one behind their last."""
        ends = np.flatnonzero(np.diff(self.stations) == 0.0) + 1  # the second of two at a break
        limits = [0, *ends.tolist(), self.stations.size]
        return limits[first - 1], limits[last]

    @cached_property
    def body(self) -> Surface:
        """Surface of the body."""
        return tube(np.zeros((self.stations.size, 2)), self.radii, 32)

    @cached_property
    def tcas(self) -> tuple[Surface, ...]:
        """Surfaces of the TCAs."""
        return tuple(
            tube(self.route(i), self.tca_radius[i], 14, self.span(i)[0]) for i in range(len(self.body_parameters.tcas))
        )

    def span(self, tca: int) -> tuple[int, int]:
        """Indices of the first cross-section of a TCA's span and of the one behind its last."""
        one = self.body_parameters.tcas[tca]
        return self.bounds(one.first_segment, one.last_segment)

    def route(self, tca: int) -> np.ndarray:
        """Positions of the axis of a TCA in the cross-sections of its span [m], (n, 2)."""
        one, s = self.body_parameters.tcas[tca], self.stations[slice(*self.span(tca))]
        angle = one.azimuth + one.helix * s
        return self.body_parameters.offset(tca, s)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def members(result: xr.Dataset) -> Mapping[str, Any]:
    """Records of the members by name: fmu, guid, parameters, signals."""
    return json.loads(result.attrs.get("members", "{}"))


def heat_members(result: xr.Dataset) -> list[str]:
    """Names of the members that are heat models of a cross-section."""
    return [m for m in members(result) if {f"{m}.V", f"{m}.T", f"{m}.T_surface"} <= set(result.data_vars)]


def section_member(result: xr.Dataset) -> str | None:
    """Name of the heat model whose section is that of the tip: of the last segment, or the only one."""
    heats, rod = heat_members(result), rod_member(result)
    if rod is None or len(heats) < 2:
        return next(iter(heats), None)
    p = RodParameters.of(recorded_parameters(result, rod))
    at_tip = {i for i, tca in enumerate(p.tcas, 1) if tca.last_segment == len(p.segments)}
    wires = [wire for wire in _heat_wires(result) if wire["rod"] == rod and int(wire["to"]) in at_tip]
    return next((wire["heat"] for wire in reversed(wires) if wire["heat"] in heats), heats[0])


def section_rod(result: xr.Dataset) -> str | None:
    """Name of the rod at whose tip the section of `section_member` is: the first that it is wired to."""
    heat = section_member(result)
    wired = [wire["rod"] for wire in _heat_wires(result) if wire["heat"] == heat]
    return wired[0] if wired else rod_member(result)


def _heat_wires(result: xr.Dataset) -> list[re.Match[str]]:
    texts = json.loads(result.attrs.get("connections", "[]"))
    return [wire for text in texts if (wire := _HEAT_WIRE.fullmatch(text))]


def rod_members(result: xr.Dataset) -> list[str]:
    """Names of the members that are rods whose shapes are known."""
    return [m for m in members(result) if {f"{m}.{name}" for name in _NEEDED} <= set(result.data_vars)]


def rod_member(result: xr.Dataset) -> str | None:
    """Name of the first member that is a rod whose shape is known."""
    return next(iter(rod_members(result)), None)


def select_rows(result: xr.Dataset, most: int) -> np.ndarray:
    """Choose at most `most` rows of a result, evenly spaced in time, the first and the last included."""
    times = result["time"].to_numpy()
    if times.size <= most:
        return np.arange(times.size)
    even = np.linspace(times[0], times[-1], most)
    after = np.searchsorted(times, even).clip(1, times.size - 1)
    return np.unique(np.where(even - times[after - 1] < times[after] - even, after - 1, after))


def manipulator(result: xr.Dataset, rows: np.ndarray, rod: str | None = None) -> Manipulator:
    """Shape of a rod, by default of the first, at some rows of a result. CosimError where it contains no rod."""
    rod = rod or rod_member(result)
    if rod is None:
        raise CosimError(
            f"result {result.attrs.get('scene', '')!r} has no shape to draw: no member with {', '.join(_NEEDED)}; "
            "run a scene with rod.fmu"
        )
    p = RodParameters.of(recorded_parameters(result, rod))
    shape, tip, temperature = (result[f"{rod}.{name}"].to_numpy()[rows] for name in _NEEDED)
    stations = _stations(p)
    return Manipulator(
        name=rod,
        times=result["time"].to_numpy()[rows],
        frames=frames(shape, tip, stations / p.length),
        stations=stations,
        temperature=temperature,
        gravity=_gravity(result, rod)[rows],
        body_parameters=p,
        tca_radius=_tca_radii(result, rod, p),
        payload=_payload(p, shape[:, -1], tip),
    )


def _stations(p: RodParameters) -> np.ndarray:
    """Evenly spaced positions [m] in each segment, its ends included."""
    breaks = p.breaks
    counts = [max(3, round((STATIONS - 1) * segment.length / p.length) + 1) for segment in p.segments]
    return np.concatenate([np.linspace(a, b, n) for a, b, n in zip(breaks, breaks[1:], counts, strict=False)])


def _tca_radii(result: xr.Dataset, rod: str, p: RodParameters) -> tuple[float, ...]:
    """Radii of the TCAs [m], from the heat model that each temperature comes from."""
    radii = [_TCA_RADIUS * p.radius] * len(p.tcas)
    heats = {name: thermal_parameters(result, name).outer_radius for name in heat_members(result)}
    for wire in _heat_wires(result):
        if wire["rod"] == rod and wire["heat"] in heats:
            radii[int(wire["to"]) - 1] = heats[wire["heat"]][int(wire["of"]) - 1]
    return tuple(radii)


def _payload(p: RodParameters, tip: np.ndarray, quaternions: np.ndarray) -> Payload | None:
    """Body at the tip at points (time, 3) [m] with orientations (time, 4), scalar part first."""
    mass, centre = p.tip_body.mass, np.array(p.tip_body.centre)
    if mass == 0.0:
        return None
    radius = np.cbrt(3.0 * mass / (4.0 * np.pi * _BALL_DENSITY))
    at = tip + Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).apply(centre)
    return Payload(mass, float(radius), at)


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
