"""Axes and legends of the figures."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

__all__ = ["grid", "legend_above", "readable_log_ticks"]

_FEW = 100.0  # ratio of an axis' ends below which decades alone are too few labels


def grid(axes: Axes) -> None:
    """Draw a light grid behind the data."""
    axes.grid(which="major", color="0.88", linewidth=0.7)
    axes.set_axisbelow(True)


def legend_above(figure: FigureBase, axes: Axes, columns: int = 6) -> None:
    """Put the legend of some axes above all axes of a figure or subfigure, where it covers nothing."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(columns, len(labels)), frameon=False)


def readable_log_ticks(axes: Axes, count: int = 6) -> None:
    """Label at most `count` decades of the logarithmic axes, so that labels stay apart; of few decades also 2 and 5."""
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() != "log":
            continue
        low, high = axis.get_view_interval()
        if high < _FEW * low:
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(10.0, 10.0)))
        else:
            axis.set_major_locator(LogLocator(numticks=count))
        axis.set_minor_formatter(NullFormatter())
