"""A result as one HTML page that needs nothing else: plotly.js, style, script and numbers are inside. Texts come from
about.py, pictures from figures.py; page.js moves them."""

from __future__ import annotations

import base64
import json
from html import escape
from itertools import cycle
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.offline import get_plotlyjs

from ...files import atomic_write
from ..charts import COLOURS, charts
from ..manipulator import STATIONS, ZERO_CELSIUS, Manipulator, manipulator, moments, of_heat, of_rod
from . import figures
from .about import about, facts
from .field import Field, field

__all__ = ["html", "write"]

_MOMENTS = 201  # that the slider knows, at most
_MILLI = 1e3
_HERE = Path(__file__).parent


def write(result: xr.Dataset, path: Path) -> None:
    """result: of a run, complete or partial. The file appears whole or not at all."""
    text = html(result)
    with atomic_write(path) as draft:
        draft.write_text(text, encoding="utf-8")


def html(result: xr.Dataset) -> str:
    """The whole page. What a result does not hold is left out: without a rod the body, without a heat model its
    cross-section."""
    rows, times = moments(result, _MOMENTS), result["time"].to_numpy()
    heat = of_heat(result)
    seen = field(result, heat, rows, STATIONS - 1) if heat else None
    drawn = manipulator(result, rows) if of_rod(result) else None
    shown, readings = charts(result), _readings(result, heat, rows)
    data = {
        "times": times[rows].tolist(),
        "decimals": max(0, 3 - int(np.floor(np.log10(times[-1] or 1.0)))),
        "readings": readings,
        "charts": [_plain(figures.chart(chart, times)) for chart in shown],
        "body": _body(drawn, seen) if drawn else None,
        "field": _field(seen, drawn) if seen else None,
    }
    return Template(_asset("page.html")).substitute(
        title=escape(str(result.attrs.get("title", "Result"))),
        subtitle=f"Scene {escape(str(result.attrs.get('scene', '?')))}, computed by tca-cosim",
        facts=facts(result),
        last=rows.size - 1,
        readings="".join(
            f"<span class='reading'><i style='background:{colour}'></i><span id='reading-{k}'></span></span>"
            for k, (colour, _) in enumerate(zip(cycle(COLOURS), readings, strict=False))
        ),
        views=_views(drawn, seen, heat),
        charts="".join(f"<div class='card' id='chart-{k}'></div>" for k in range(len(shown))),
        about=about(result),
        style=_asset("page.css"),
        plotly=get_plotlyjs(),
        script=_asset("page.js"),
        data=json.dumps(data).replace("<", "\\u003c"),  # nothing in it may end the element that holds it
    )


def _views(drawn: Manipulator | None, seen: Field | None, heat: str | None) -> str:
    cards = []
    if drawn:
        cards.append(
            "<div class='card'><h3>The manipulator</h3><p class='soft'>True radius, TCAs coloured by their mean "
            "temperature; drag to turn, scroll to zoom.</p><div id='body'></div></div>"
        )
    if seen:
        cards.append(
            "<div class='card'><h3>Temperature of the cross-section</h3><p class='soft'>Finite elements, heated by the "
            f"same powers as {escape(str(heat))}: their means over the TCAs stay within {seen.gap:.1g} K of its "
            "own.</p><div id='section'></div></div>"
        )
    return f"<section class='views{' one' if len(cards) == 1 else ''}'>{''.join(cards)}</section>" if cards else ""


def _readings(result: xr.Dataset, heat: str | None, rows: np.ndarray) -> list[list[str]]:
    """For each TCA a text per moment."""
    if heat is None:
        return []
    volts, celsius = result[f"{heat}.V"].to_numpy()[rows], result[f"{heat}.T"].to_numpy()[rows] - ZERO_CELSIUS
    return [
        [f"{V:.2f} V, {T:.1f} °C" for V, T in zip(*pair, strict=True)] for pair in zip(volts.T, celsius.T, strict=True)
    ]


def _body(drawn: Manipulator, seen: Field | None) -> dict[str, Any]:
    """Lengths in mm, temperatures in degrees Celsius."""
    figure, surfaces = figures.body(drawn, seen)
    return {
        "figure": _plain(figure),
        "stations": STATIONS,
        "tcas": len(drawn.tcas),
        "p": _packed(_MILLI * drawn.frames.p),
        "d1": _packed(drawn.frames.d1),
        "d2": _packed(drawn.frames.d2),
        "surfaces": [
            {"offsets": _packed(_MILLI * s.offsets), "stations": _packed(s.stations, np.int32)} for s in surfaces
        ],
        "temperatures": _packed(drawn.temperature - ZERO_CELSIUS),
    }


def _field(seen: Field, drawn: Manipulator | None) -> dict[str, Any]:
    return {
        "figure": _plain(figures.section(seen, drawn)),
        "points": seen.raster.shape[0],
        "modes": seen.courses.shape[1],
        "zero": seen.T_0 - ZERO_CELSIUS,
        "courses": _packed(seen.courses),
        "raster": _packed(seen.raster),
        "cap": _packed(seen.cap_modes),
    }


def _plain(figure: go.Figure) -> dict[str, Any]:
    return json.loads(str(figure.to_json()))


def _packed(values: np.ndarray, kind: type[np.generic] = np.float32) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _asset(name: str) -> str:
    return (_HERE / name).read_text(encoding="utf-8")
