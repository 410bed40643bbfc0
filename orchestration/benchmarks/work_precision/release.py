"""Figure of the release of the bare rod beside other codes (requires tca-cosim[peers]).

From the table of `tca-cosim peers`: error of the tip at 0.1 s against CPU time, undamped and damped.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...plotting import MARKERS, grid, series_colour
from ..peers.table import PeerRow
from .norm import pareto_front
from .plot import FAILED

__all__ = ["draw"]


def draw(rows: Sequence[PeerRow], notes: Sequence[str]) -> Figure:
    """Draw the rows and notes of peers.compare_peers()."""
    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    codes = list(dict.fromkeys((row.code, row.dim) for row in rows))
    for panel, damped in zip(axes, (False, True), strict=True):
        _panel(panel, [row for row in rows if row.damped == damped], codes)
        panel.set_xlabel("error of the tip at 0.1 s [µm]")
        panel.set_title("damped, retardation 5 ms" if damped else "undamped", fontsize=11)
    axes[0].set_ylabel("CPU time per second simulated [s/s], median and quartiles")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle(
        f"A bare rod, let go under gravity: rod.fmu beside other codes\n{notes[0]}; one thread", fontsize=11
    )
    return figure


def _panel(axes: Axes, rows: Sequence[PeerRow], codes: Sequence[tuple[str, int]]) -> None:
    axes.set(xscale="log", yscale="log")
    grid(axes)
    best = pareto_front(np.array([row.error for row in rows]), np.array([row.cpu for row in rows]))
    edge = sorted((row.error, row.cpu) for row, good in zip(rows, best, strict=True) if good)
    axes.plot(*zip(*edge, strict=True), color="0.75", linewidth=5.0, solid_capstyle="round", zorder=1, label="best")
    for k, (code, dim) in enumerate(codes):
        own = [row for row in rows if (row.code, row.dim) == (code, dim)]
        label = f"{code}, {'planar' if dim == 2 else 'spatial'}"
        good = [row for row in own if np.isfinite(row.error)]
        spread = [[row.cpu - row.cpu_low for row in good], [row.cpu_high - row.cpu for row in good]]
        style: dict[str, Any] = {"color": series_colour(k), "marker": MARKERS[k], "markersize": 6, "linestyle": ""}
        axes.errorbar([row.error for row in good], [row.cpu for row in good], spread, label=label, **style)
        for row in own:
            if math.isinf(row.largest_error):  # unstable: at the edge
                axes.plot(1.0, row.cpu, "x", color=FAILED, transform=axes.get_yaxis_transform(), clip_on=False)
