"""Figure of a chart: error to the right, cost upwards; CPU time above, evaluations (machine-independent) below.

One column per panel. The best points lie at the lower left."""

from __future__ import annotations

import json
import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

__all__ = ["COLOURS", "DPI", "FAILED", "MARKERS", "draw"]

DPI = 90  # resolution of the PNGs [dots per inch]
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#000000")  # Okabe, Ito
MARKERS = "osD^vP*X"
FAILED = "#d62728"


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the table of run_chart()."""
    titles = json.loads(dataset.attrs["panels"])
    panels = [key for key in titles if (dataset["panel"] == key).any()]
    figure = Figure(figsize=(1.2 + 4.0 * len(panels), 8.4), layout="constrained")
    axes = figure.subplots(2, len(panels), sharex=True, sharey="row", squeeze=False)
    edge = _limits(dataset, axes[0, 0])
    for column, key in zip(axes.T, panels, strict=True):
        here = dataset.isel(point=np.flatnonzero(dataset["panel"] == key))
        names = list(dict.fromkeys(here["series"].to_numpy().tolist()))
        for panel, cost in zip(column, ("time", "work"), strict=True):
            _frame(panel, dataset, cost, edge)
            for k, name in enumerate(names):
                _series(panel, here.isel(point=np.flatnonzero(here["series"] == name)), cost, k, edge)
        column[0].set_title(titles[key], fontsize=11)
        column[1].legend(
            handles=[_key(k, name) for k, name in enumerate(names)],
            loc="upper center",
            bbox_to_anchor=(0.5, -0.16),
            ncols=2,
            fontsize=9,
            frameon=False,
        )
        column[1].set_xlabel("error [1]")
    axes[0, 0].set_ylabel("CPU time of a warm run [s]")
    axes[1, 0].set_ylabel("evaluations of the rod's equations [1]\n(scipy: right-hand sides or shots)")
    width = figure.get_figwidth()
    figure.supxlabel(_wrapped(_below(dataset), 10.5 * width), fontsize=9)
    figure.suptitle(_wrapped(dataset.attrs["title"], 8.5 * width), fontsize=13)
    return figure


def _wrapped(text: str, characters: float) -> str:
    """Text in lines of at most that many characters."""
    return "\n".join(textwrap.fill(line, int(characters)) for line in text.splitlines())


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
    axes.grid(which="major", color="0.9", linewidth=0.7)
    axes.set_axisbelow(True)
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
    looks = {"color": COLOURS[number % len(COLOURS)], "marker": MARKERS[number % len(MARKERS)]}
    return {**looks, "markersize": 5.5, "linewidth": 1.2}


def _below(dataset: xr.Dataset) -> str:
    machine = json.loads(dataset.attrs["machine"])
    return (
        f"{dataset.attrs['axis']}. Grey line, rings: no other point is faster and as exact. Dotted: floor "
        f"{dataset.attrs['floor']:.0e}, the gap between two refined monoliths. Red edge: failed.\n"
        f"Times: median and quartiles of {dataset.attrs['repeats']} rounds, one thread of {machine['processor']}, "
        f"whose {machine['cores']} cores had a load of {machine['load']}; commit {dataset.attrs['commit']}"
    )
