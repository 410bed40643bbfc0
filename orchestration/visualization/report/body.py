"""Numbers of the view of the body, which body.js draws: lengths in mm, temperatures in degrees Celsius."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..manipulator import STATIONS, ZERO_CELSIUS, Manipulator
from .document import pack_small

__all__ = ["body_data", "temperature_range"]

_MILLI = 1e3


def body_data(m: Manipulator, other: Manipulator | None = None) -> dict[str, Any]:
    """Shape, dimensions, temperatures and gravity over time; of another result its shape."""
    corners = [_MILLI * one.frames.sweep(one.body.offsets, one.body.stations) for one in (m, other) if one]
    tip = m.frames.p[-1, -1]
    constant = not np.ptp(m.gravity, axis=0).any()
    return {
        "stations": STATIONS,
        "radius": _MILLI * m.radius,
        "tcaRadius": [_MILLI * radius for radius in m.tca_radius],
        "routes": [(_MILLI * m.route(i)).round(4).tolist() for i in range(m.azimuth.size)],
        "temperatures": pack_small(m.temperature - ZERO_CELSIUS),
        "gravity": (m.gravity[:1] if constant else m.gravity).round(4).tolist() if m.gravity.any() else [],
        "low": np.min([c.min(axis=(0, 1)) for c in corners], axis=0).tolist(),
        "high": np.max([c.max(axis=(0, 1)) for c in corners], axis=0).tolist(),
        "azimuth": float(np.arctan2(tip[1], tip[0])) - 0.95,  # [rad] so that the tip bends towards the viewer
        "shape": _shape(m),
        "other": _shape(other) | {"radius": _MILLI * other.radius} if other else None,
    }


def temperature_range(*kelvin: np.ndarray) -> tuple[float, float]:
    """Range of the colours [degC] of everything that is coloured by temperature, at least 1 K wide."""
    low = min(float(values.min()) for values in kelvin) - ZERO_CELSIUS
    high = max(float(values.max()) for values in kelvin) - ZERO_CELSIUS
    return low, max(high, low + 1.0)


def _shape(m: Manipulator) -> dict[str, Any]:
    return {"p": pack_small(_MILLI * m.frames.p), "d1": pack_small(m.frames.d1), "d2": pack_small(m.frames.d2)}
