"""HTML document from its parts: texts, charts, and numbers for the scripts."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, field
from html import escape
from itertools import starmap
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from matplotlib import colormaps

from ..charts import Chart
from .svg import Drawing

__all__ = ["ChartCard", "Document", "pack", "pack_small", "plasma", "section_of_charts"]

_HERE = Path(__file__).parent
_INT16 = 32767  # largest value of 16 bits


@dataclass(frozen=True)
class ChartCard:
    """Chart of the page with its values at the times of the slider."""

    chart: Chart
    drawing: Drawing
    rows: np.ndarray  # indices of the slider's times in the chart's values


@dataclass(frozen=True)
class Document:
    """Parts of a page; `data` goes to the scripts."""

    title: str
    subtitle: str
    facts: str
    readings: str
    views: str
    charts: str
    texts: str
    last: int  # index of the last time of the slider
    data: dict[str, Any] = field(default_factory=dict)

    def html(self) -> str:
        """Assemble the page."""
        return Template(_asset("page.html")).substitute(
            title=escape(self.title),
            subtitle=escape(self.subtitle),
            facts=self.facts,
            readings=self.readings,
            views=self.views,
            charts=self.charts,
            texts=self.texts,
            last=self.last,
            style=_asset("page.css"),
            script="".join(map(_asset, ("body.js", "section.js", "page.js"))),
            data=json.dumps(self.data).replace("<", "\\u003c"),  # nothing in it may end the element that contains it
        )


def section_of_charts(cards: list[ChartCard]) -> str:
    """HTML of the charts; their legends show the values at the time of the slider."""
    return "".join(starmap(_chart_card, enumerate(cards)))


def _chart_card(number: int, card: ChartCard) -> str:
    chart = card.chart
    legend = "".join(
        f"<li><i class='swatch{' dashed' if line.dashed else ''}' style='--c: var(--c{line.number % 8})'></i>"
        f"{escape(line.label)} <b id='value-{number}-{k}'></b></li>"
        for k, line in enumerate(chart.lines)
    )
    constants = f"<p class='soft'>Constant: {escape(chart.constants_text)}</p>" if chart.constants else ""
    return (
        f"<figure class='card chart'><figcaption><h3>{escape(chart.heading)}</h3></figcaption>"
        f"<div class='plot' id='chart-{number}'>{card.drawing.svg}</div>"
        f"<ul class='legend'>{legend}</ul>{constants}</figure>"
    )


def pack(values: np.ndarray) -> str:
    """Array as base64 of 32-bit floats."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=np.float32).tobytes()).decode()


def pack_small(values: np.ndarray) -> dict[str, Any]:
    """Array as base64 of 16-bit integers and their scale: half the size, errors below 2e-5 of the largest value."""
    scale = float(np.abs(values).max(initial=0.0)) / _INT16 or 1.0
    integers = np.round(values / scale).astype(np.int16)
    return {"scale": scale, "data": base64.b64encode(np.ascontiguousarray(integers).tobytes()).decode()}


def plasma() -> str:
    """Colour map of the temperatures as base64 of 256 x 3 bytes."""
    colours = np.round(255 * colormaps["plasma"](np.linspace(0.0, 1.0, 256))[:, :3]).astype(np.uint8)
    return base64.b64encode(colours.tobytes()).decode()


def _asset(name: str) -> str:
    return (_HERE / name).read_text(encoding="utf-8")
