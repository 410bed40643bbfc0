"""Figures of a chart, one per panel: error to the right, cost upwards.

Left: CPU time; right: evaluations, which do not depend on the machine. The best points lie at the lower left.
"""

from __future__ import annotations

import json
import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...plotting import MARKERS, SERIES, grid, readable_log_ticks, series_colour

__all__ = ["DPI", "FAILED", "draw", "panels"]

DPI = 100  # resolution of the PNGs [dots per inch]
FAILED = SERIES[1]  # colour of the edge where failures are drawn; their markers are crosses


def panels(dataset: xr.Dataset) -> list[str]:
    """Names of the panels of a table of run_chart() in their order."""
    return [key for key in json.loads(dataset.attrs["panels"]) if (dataset["panel"] == key).any()]


def draw(dataset: xr.Dataset, panel: str) -> Figure:
    """Draw one panel of the table of run_chart()."""
    title = json.loads(dataset.attrs["panels"])[panel]
    here = dataset.isel(point=np.flatnonzero(dataset["panel"] == panel))
    names = list(dict.fromkeys(here["series"].to_numpy().tolist()))
    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    inside = figure.subfigures(1, 1, squeeze=False)[0, 0]  # its legend then stands below the title
    both = inside.subplots(1, 2, sharex=True, squeeze=False)[0]
    edge = _limits(dataset, both[0])
    for axes, cost in zip(both, ("time", "work"), strict=True):
        _frame(axes, dataset, cost, edge)
        for k, name in enumerate(names):
            _series(axes, here.isel(point=np.flatnonzero(here["series"] == name)), cost, k, edge)
        axes.set_xlabel("error [1]")
        readable_log_ticks(axes)
    both[0].set_title("CPU time of a warm run [s]", fontsize=11, loc="left")
    both[1].set_title("evaluations of the rod's equations [1]", fontsize=11, loc="left")
    handles = [_key(k, name) for k, name in enumerate(names)]
    inside.legend(handles=handles, loc="outside upper center", ncols=min(4, len(names)), frameon=False)
    figure.supxlabel(_wrapped(_note(dataset), 115), fontsize=9, x=0.01, ha="left")
    figure.suptitle(_wrapped(f"{dataset.attrs['title']}: {title}", 80), fontsize=13)
    return figure


def _wrapped(text: str, characters: int) -> str:
    """Text in lines of at most that many characters."""
    return "\n".join(textwrap.fill(line, characters) for line in text.splitlines())


def _limits(dataset: xr.Dataset, axes: Axes) -> float:
    """Set the axis of errors; the position at which failures are drawn on it."""
    good = dataset["error"].to_numpy()[np.isfinite(dataset["error"])]
    floor = max(float(dataset.attrs["floor"]), 1e-12)
    least = min(floor, *good) if good.size else floor
    most = max(1.0, *good) if good.size else 1.0
    axes.set(xscale="log", yscale="log", xlim=(least / 3.0, most * 30.0))
    return most * 10.0


def _frame(axes: Axes, dataset: xr.Dataset, cost: str, edge: float) -> None:
    """Draw grid, floor, edge of failures and the Pareto front of the whole chart."""
    axes.set(xscale="log", yscale="log")
    grid(axes)
    floor = float(dataset.attrs["floor"])
    axes.axvspan(axes.get_xlim()[0], floor, color="0.93", zorder=0)
    axes.axvline(floor, color="0.5", linestyle=":", linewidth=1.2)
    axes.axvspan(edge / 3.0, axes.get_xlim()[1], color=FAILED, alpha=0.08, zorder=0, linewidth=0)
    if cost == "time":
        best = dataset.isel(point=np.flatnonzero(dataset["front"])).sortby("error")
        axes.plot(best["error"], best["time"], color="0.75", linewidth=5.0, solid_capstyle="round", zorder=1)


def _series(axes: Axes, points: xr.Dataset, cost: str, number: int, edge: float) -> None:
    good = points.isel(point=np.flatnonzero(np.isfinite(points["error"])))
    style = _style(number)
    if cost == "time":
        spread = [good["time"] - good["time_low"], good["time_high"] - good["time"]]
        axes.errorbar(good["error"], good["time"], spread, elinewidth=1.0, **style)
        best = good.isel(point=np.flatnonzero(good["front"]))
        axes.plot(best["error"], best["time"], "o", markersize=11, markerfacecolor="none", color="black", zorder=4)
    else:
        axes.plot(good["error"], good["work"], **style)
    failed = points.isel(point=np.flatnonzero(~np.isfinite(points["error"])))
    if cost == "time" and failed.sizes["point"]:
        cross = {"marker": "x", "linestyle": "", "color": style["color"], "markersize": 8, "markeredgewidth": 2}
        axes.plot([edge] * failed.sizes["point"], failed["cold"], **cross)


def _key(number: int, name: str) -> Line2D:
    return Line2D([], [], label=name, **_style(number))


def _style(number: int) -> dict[str, Any]:
    marker = MARKERS[number % len(MARKERS)]
    return {"color": series_colour(number), "marker": marker, "markersize": 6.0, "linewidth": 1.3}


def _note(dataset: xr.Dataset) -> str:
    machine = json.loads(dataset.attrs["machine"])
    return (
        f"{dataset.attrs['axis']}. Grey line, rings: no other point is faster and as exact. Dotted: floor "
        f"{dataset.attrs['floor']:.0e}, the gap between two refined monoliths. Coloured edge: failed. "
        "Evaluations of scipy are right-hand sides or integrations along the rod.\n"
        f"Times: median and quartiles of {dataset.attrs['repeats']} rounds, one thread of {machine['processor']}, "
        f"whose {machine['cores']} cores had a load of {machine['load']}; commit {dataset.attrs['commit']}"
    )
