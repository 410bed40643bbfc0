"""Charts as SVG for the page: drawn by matplotlib, coloured by the page's style, so that they follow its dark mode."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from types import MappingProxyType
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...plotting import SERIES, series_colour
from ..charts import Chart
from ..plots import draw_chart

__all__ = ["Drawing", "draw"]

_WIDTH, _HEIGHT = 350.0, 200.0  # of a chart [pt]; as wide as a phone, so that its text is readable there
_POINTS_PER_INCH = 72.0
_INK, _GRID = "#010203", "#040506"  # colours that stand for those of the page's style
_SETTINGS: dict[Any, Any] = {
    "svg.fonttype": "none",  # text stays text
    "font.size": 10.0,
    "path.simplify_threshold": 0.3,  # [pixel] deviation that nobody sees
    **dict.fromkeys(("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"), _INK),
}
_NO_METADATA = dict.fromkeys(("Creator", "Date", "Format", "Type"))


@dataclass(frozen=True)
class Drawing:
    """SVG of a chart, and where its times lie in it."""

    svg: str
    left: float  # x of the first time in units of the SVG
    right: float  # x of the last time
    first: float  # [s]
    last: float  # [s]


def draw(
    number: int,
    chart: Chart,
    times: np.ndarray,
    other: Mapping[str, np.ndarray],
    other_times: np.ndarray,
    samples: Mapping[str, tuple[np.ndarray, np.ndarray]] = MappingProxyType({}),
) -> Drawing:
    """Draw a chart.

    Parameters
    ----------
    number : int
        Number of the chart on the page, which makes the ids in its SVG unique.
    other : mapping
        Values over `other_times` of another result by the labels of the lines; drawn dotted.
    samples : mapping
        Times [s] and values of measured samples by the names of the lines; drawn as circles.
    """
    with matplotlib.rc_context(_SETTINGS | {"svg.hashsalt": f"chart {number}"}):
        figure = Figure(figsize=(_WIDTH / _POINTS_PER_INCH, _HEIGHT / _POINTS_PER_INCH), layout="constrained")
        axes = figure.add_subplot()
        draw_chart(axes, chart, times, title=False)
        for line in chart.lines:
            if line.label in other:
                colour = series_colour(line.number)
                axes.plot(other_times, other[line.label], color=colour, linestyle=":", linewidth=2.2)
            if line.name in samples:
                axes.plot(*samples[line.name], "o", color=series_colour(line.number), markersize=3.2, fillstyle="none")
        axes.grid(color=_GRID)
        file = io.StringIO()
        figure.savefig(file, format="svg", transparent=True, metadata=_NO_METADATA)
    return _finish(number, chart, axes, times, file.getvalue())


def _finish(number: int, chart: Chart, axes: Axes, times: np.ndarray, text: str) -> Drawing:
    """Make the SVG part of a page: colours by its style, unique ids, a label, a line for the time."""
    text = text[text.index("<svg") :]
    for k, colour in enumerate(SERIES):
        text = text.replace(colour, f"var(--c{k})")
    text = text.replace(_INK, "currentColor").replace(_GRID, "var(--line)")
    text = re.sub(r"(font[^;\"']*?)'DejaVu Sans'[^;\"]*", r"\1inherit", text)
    text = re.sub(r"\bid=\"", f'id="c{number}-', text)
    text = re.sub(r"(url\(#|href=\"#)", rf"\1c{number}-", text)
    text = re.sub(r"\s*\n\s*", "\n", text)
    label = escape(chart.heading + " over time: " + ", ".join(line.label for line in chart.lines), quote=True)
    text = re.sub(
        r"<svg [^>]*?viewBox=\"([^\"]*)\"[^>]*>", rf'<svg viewBox="\1" role="img" aria-label="{label}">', text
    )
    box = axes.get_window_extent().transformed(axes.figure.transFigure.inverted())
    limits = np.array(axes.get_xlim())
    share = (times[[0, -1]] - limits[0]) / (limits[1] - limits[0])
    left, right = _WIDTH * (box.x0 + (box.x1 - box.x0) * share)
    top, bottom = _HEIGHT * (1.0 - box.y1), _HEIGHT * (1.0 - box.y0)
    cursor = f'<line class="cursor" x1="{left:.2f}" x2="{left:.2f}" y1="{top:.2f}" y2="{bottom:.2f}"/>'
    text = text.replace("</svg>", f"{cursor}</svg>")
    return Drawing(text, float(left), float(right), float(times[0]), float(times[-1]))
