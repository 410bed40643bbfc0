"""Numbers of the view of the bodies, which body.js draws: lengths in mm, temperatures in degrees Celsius."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..assembly import FACES, Assembly, Block
from ..manipulator import ZERO_CELSIUS, Manipulator, Payload
from .document import pack_small

__all__ = ["body_data", "temperature_range"]

_MILLI = 1e3


def body_data(shown: Assembly, other: Assembly | None = None, section: str | None = None) -> dict[str, Any]:
    """Shapes, dimensions, temperatures and gravity over time; of another result the shapes.

    section: name of the rod that the picture of a cross-section belongs to, at whose tip it is drawn.
    """
    extents = [one.extent for one in (shown, other) if one]
    constant = not np.ptp(shown.gravity, axis=0).any()
    gravity = shown.gravity[:1] if constant else shown.gravity
    return {
        "manipulators": [_manipulator(m) | {"section": m.name == section} for m in shown.manipulators],
        "names": len(shown.manipulators) > 1,
        "blocks": [_block(block) for block in shown.blocks],
        "faces": FACES.tolist(),
        "gravity": gravity.round(4).tolist() if gravity.any() else [],
        "low": (_MILLI * np.min([low for low, _ in extents], axis=0)).tolist(),
        "high": (_MILLI * np.max([high for _, high in extents], axis=0)).tolist(),
        "azimuth": shown.azimuth - (0.95 if len(shown.manipulators) == 1 else 0.25),  # [rad] of the viewer
        "others": [_shape(m) | {"radii": (_MILLI * m.radii).tolist()} for m in (other.manipulators if other else ())],
    }


def _manipulator(m: Manipulator) -> dict[str, Any]:
    return {
        "name": m.name,
        "radii": (_MILLI * m.radii).round(4).tolist(),
        "breaks": (np.flatnonzero(np.diff(m.stations) == 0.0) + 1).tolist(),
        "tcaRadius": [_MILLI * radius for radius in m.tca_radius],
        "routes": [
            {"first": m.span(i)[0], "points": (_MILLI * m.route(i)).round(4).tolist()} for i in range(len(m.tca_radius))
        ],
        "temperatures": pack_small(m.temperature - ZERO_CELSIUS),
        "shape": _shape(m),
        "payload": _payload(m.payload) if m.payload else None,
    }


def _payload(payload: Payload) -> dict[str, Any]:
    return {
        "radius": _MILLI * payload.radius,
        "centre": pack_small(_MILLI * payload.centre),
        "label": f"{_MILLI * payload.mass:.3g} g",
    }


def _block(block: Block) -> dict[str, Any]:
    return {"name": block.name, "corners": pack_small(_MILLI * block.corners)}


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
