"""A result on one sheet: a panel per chart, as a matplotlib figure."""

from __future__ import annotations

import io
import math

import xarray as xr
from matplotlib.figure import Figure

from .charts import charts

__all__ = ["Sheet", "plot"]

_COLUMNS = 3


class Sheet(Figure):
    """A figure that notebooks show; savefig writes it."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.savefig(file, format="png", dpi=90)
        return file.getvalue()


def plot(result: xr.Dataset) -> Sheet:
    """result: of a run."""
    shown = charts(result)
    rows = math.ceil(len(shown) / _COLUMNS)
    figure = Sheet(figsize=(4.6 * _COLUMNS, 2.6 * rows + 0.5), layout="constrained")
    places = figure.subplots(rows, _COLUMNS, sharex=True, squeeze=False).flat
    for axes, chart in zip(places, shown, strict=False):
        for line in chart.lines:
            style = {"color": line.colour, "linestyle": "--" if line.dashed else "-", "linewidth": 1.3}
            axes.plot(
                result["time"],
                line.values,
                label=line.label,
                drawstyle="steps-pre" if chart.stepped else "default",
                **style,
            )
        axes.set_title(f"{chart.title} [{chart.unit}]", fontsize=9, loc="left")
        axes.set_yscale("log" if chart.log else "linear")
        if chart.from_zero:
            axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.3)
        if len(chart.lines) > 1:
            axes.legend(fontsize=7)
    for k in range(len(shown), rows * _COLUMNS):
        figure.axes[k].set_visible(False)
    for axes in figure.axes[max(0, len(shown) - _COLUMNS) : len(shown)]:
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("t [s]")
    figure.suptitle(str(result.attrs.get("title", "")), fontsize=11)
    return figure
