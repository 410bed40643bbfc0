"""The view of the body alone, for notebooks."""

from __future__ import annotations

import xarray as xr

from ..manipulator import manipulator, select_rows
from .body import body_data, temperature_range
from .document import Document, plasma
from .texts import BODY_CARD, SLIDER_ROWS, decimals, time_readings

__all__ = ["html"]


def html(result: xr.Dataset) -> str:
    """Page with the body, coloured by the mean temperatures of the TCAs. CosimError where the result has no rod."""
    rows = select_rows(result, SLIDER_ROWS)
    shape = manipulator(result, rows)
    readings = time_readings(result, rows)
    return Document(
        title=str(result.attrs.get("title", "Result")),
        subtitle="",
        facts="",
        readings=readings.html,
        views=f"<section class='views one'>{BODY_CARD}</section>",
        charts="",
        texts="",
        last=rows.size - 1,
        data={
            "times": shape.times.tolist(),
            "decimals": decimals(shape.times),
            "readings": readings.texts,
            "charts": [],
            "colours": plasma(),
            "range": temperature_range(shape.temperature),
            "body": body_data(shape),
            "section": None,
        },
    ).html()
