"""Charts of a result as a matplotlib figure, one panel for each chart."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..errors import CosimError
from ..files import atomic_write
from ..plotting import grid, readable_log_ticks, series_colour
from .charts import Chart, charts, charts_of

__all__ = ["Sheet", "draw_chart", "plot", "save"]

_COLUMNS = 2
_WIDTH, _HEIGHT = 5.2, 2.7  # of a panel [in]
_ENDINGS = (".png", ".svg", ".pdf")


class Sheet(Figure):
    """Figure that notebooks show."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.savefig(file, format="png", dpi=90)
        return file.getvalue()


def plot(result: xr.Dataset, quantities: Sequence[str] | None = None) -> Sheet:
    """Draw the charts of a result.

    Parameters
    ----------
    quantities : sequence of str, optional
        Names of variables, a panel each; by default everything that changes.

    Raises
    ------
    CosimError
        The result has no quantity of that name.
    """
    if isinstance(quantities, str):
        quantities = [quantities]
    everything = charts(result) if quantities is None else charts_of(result, quantities)
    drawn = [chart for chart in everything if chart.lines]
    columns = min(_COLUMNS, max(1, len(drawn)))
    rows = max(1, math.ceil(len(drawn) / columns))
    figure = Sheet(figsize=(_WIDTH * columns, _HEIGHT * rows + 0.5), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).flat
    for axes, chart in zip(panels, drawn, strict=False):
        draw_chart(axes, chart, result["time"].to_numpy())
    for axes in figure.axes[len(drawn) :]:
        axes.set_visible(False)
    constant = [f"{chart.title}: {chart.constants_text}" for chart in everything if chart.constants]
    if constant:
        figure.supxlabel("Constant: " + "\n".join(constant), fontsize=9, x=0.01, ha="left")
    figure.suptitle(str(result.attrs.get("title", "")), fontsize=12)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure as .png, .svg or .pdf; the file appears whole or not at all. CosimError for another ending."""
    if path.suffix not in _ENDINGS:
        raise CosimError(f"{path}: unknown ending {path.suffix!r}; allowed: {', '.join(_ENDINGS)}")
    with atomic_write(path) as draft:
        figure.savefig(draft, dpi=110)


def draw_chart(axes: Axes, chart: Chart, times: np.ndarray, title: bool = True) -> None:
    """Draw one chart; its legend stands above the axes, where it covers nothing."""
    for line in chart.lines:
        axes.plot(
            times,
            line.values,
            label=line.label,
            color=series_colour(line.number),
            linestyle="--" if line.dashed else "-",
            linewidth=1.5,
            drawstyle="steps-pre" if chart.stepped else "default",
            marker="." if _has_gaps(line.values) else None,
            markersize=3.0,
        )
    axes.set_yscale("log" if chart.log else "linear")
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    if chart.log:
        readable_log_ticks(axes)
    else:
        axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
    if chart.from_zero:
        highest = max(float(np.nanmax(line.values)) for line in chart.lines)
        axes.set_ylim(0.0, 1.08 * highest or 1.0)
    axes.set_xlabel("t [s]")
    grid(axes)
    if title:
        labelled = len(chart.lines) + len(chart.constants) > 1
        columns = 2 if max(len(line.label) for line in chart.lines) > 12 else 3
        rows = math.ceil(len(chart.lines) / columns) if labelled else 0
        axes.set_title(chart.heading, fontsize=11, loc="left", pad=6 + 15 * rows)
        if labelled:
            axes.legend(
                loc="lower left",
                bbox_to_anchor=(-0.02, 1.0),
                borderaxespad=0.0,
                ncols=columns,
                fontsize=9,
                frameon=False,
                labelspacing=0.2,
            )


def _has_gaps(values: np.ndarray) -> bool:
    """Tell whether values are missing between others, so that a line would not show all of them."""
    known = np.flatnonzero(np.isfinite(values))
    return bool(known.size) and known[-1] - known[0] + 1 > known.size
