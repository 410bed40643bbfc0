"""The view of the body alone, for notebooks."""

from __future__ import annotations

import xarray as xr

from ..assembly import assembly
from ..manipulator import select_rows
from .body import body_data, temperature_range
from .document import Document, plasma
from .texts import SLIDER_ROWS, body_card, decimals, time_readings

__all__ = ["html"]


def html(result: xr.Dataset) -> str:
    """Page with the bodies, coloured by the mean temperatures of the TCAs. CosimError where the result has no rod."""
    rows = select_rows(result, SLIDER_ROWS)
    bodies = assembly(result, rows)
    readings = time_readings(result, rows)
    return Document(
        title=str(result.attrs.get("title", "Result")),
        subtitle="",
        facts="",
        readings=readings.html,
        views=f"<section class='views one'>{body_card(bodies)}</section>",
        charts="",
        texts="",
        last=rows.size - 1,
        data={
            "times": bodies.times.tolist(),
            "decimals": decimals(bodies.times),
            "readings": readings.texts,
            "charts": [],
            "colours": plasma(),
            "range": temperature_range(bodies.temperatures),
            "body": body_data(bodies),
            "section": None,
        },
    ).html()
