"""Numbers of the view of the body, which body.js draws: lengths in mm, temperatures in degrees Celsius."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..manipulator import ZERO_CELSIUS, Manipulator, Payload
from .document import pack_small

__all__ = ["body_data", "temperature_range"]

_MILLI = 1e3


def body_data(m: Manipulator, other: Manipulator | None = None) -> dict[str, Any]:
    """Shape, dimensions, temperatures and gravity over time; of another result its shape."""
    corners = [_MILLI * points for one in (m, other) if one for points in _extent(one)]
    tip = m.frames.p[-1, -1]
    constant = not np.ptp(m.gravity, axis=0).any()
    return {
        "stations": m.stations.size,
        "radii": (_MILLI * m.radii).round(4).tolist(),
        "breaks": (np.flatnonzero(np.diff(m.stations) == 0.0) + 1).tolist(),
        "tcaRadius": [_MILLI * radius for radius in m.tca_radius],
        "routes": [
            {"first": m.span(i)[0], "points": (_MILLI * m.route(i)).round(4).tolist()} for i in range(len(m.tca_radius))
        ],
        "temperatures": pack_small(m.temperature - ZERO_CELSIUS),
        "gravity": (m.gravity[:1] if constant else m.gravity).round(4).tolist() if m.gravity.any() else [],
        "low": np.min([c.min(axis=(0, 1)) for c in corners], axis=0).tolist(),
        "high": np.max([c.max(axis=(0, 1)) for c in corners], axis=0).tolist(),
        "azimuth": float(np.arctan2(tip[1], tip[0])) - 0.95,  # [rad] so that the tip bends towards the viewer
        "shape": _shape(m),
        "payload": _payload(m.payload) if m.payload else None,
        "other": _shape(other) | {"radii": (_MILLI * other.radii).tolist()} if other else None,
    }


def _extent(m: Manipulator) -> list[np.ndarray]:
    """Points (time, n, 3) [m] whose bounding box contains the body and what it carries."""
    points = [m.frames.sweep(m.body.offsets, m.body.stations)]
    if m.payload:
        reach = m.payload.radius * np.vstack([np.eye(3), -np.eye(3)])
        points.append(m.payload.centre[:, None] + reach)
    return points


def _payload(payload: Payload) -> dict[str, Any]:
    return {
        "radius": _MILLI * payload.radius,
        "centre": pack_small(_MILLI * payload.centre),
        "label": f"{_MILLI * payload.mass:.3g} g",
    }


def temperature_range(*kelvin: np.ndarray) -> tuple[float, float]:
    """Range of the colours [degC] of everything that is coloured by temperature, at least 1 K wide."""
    low = min(float(values.min()) for values in kelvin) - ZERO_CELSIUS
    high = max(float(values.max()) for values in kelvin) - ZERO_CELSIUS
    return low, max(high, low + 1.0)


def _shape(m: Manipulator) -> dict[str, Any]:
    return {
        "stations": m.stations.size,
        "p": pack_small(_MILLI * m.frames.p),
        "d1": pack_small(m.frames.d1),
        "d2": pack_small(m.frames.d2),
    }
