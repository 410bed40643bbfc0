"""Figure of a stability map: one panel per method.

Colour: sweeps where the method converged. Hatching: kind of failure. Line: limit of theory. Dots: single known limits.
"""

from __future__ import annotations

import json
import math
import textwrap

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...plotting import FAILURES
from .verdict import KINDS

__all__ = ["draw"]

TITLE_WIDTH = 90  # characters of a line of the title
COLUMNS = 2  # as wide as a page shows them readably
MOST_SWEEPS = 200.0  # upper end of the colour scale; runs are stopped there


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the dataset of run_study()."""
    count = dataset.sizes["panel"]
    rows = math.ceil(count / COLUMNS)
    figure = Figure(figsize=(9.0, 3.1 * rows + 1.5), layout="constrained")
    axes = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False)
    described = json.loads(dataset.attrs["panels"])
    for k, panel in enumerate(axes.flat):
        if k >= count:
            panel.set_visible(False)
            axes.flat[k - COLUMNS].tick_params(labelbottom=True)
            continue
        image = _panel(panel, dataset.isel(panel=k), described[k]["marks"])  # one scale of colours for all
        if k % COLUMNS == 0:
            panel.set_ylabel(f"{dataset['strength'].attrs['long_name']} [1]")
        if k + COLUMNS >= count:
            panel.set_xlabel("macro step H [s]")
    ticks = [1, 2, 5, 10, 20, 50, 100, 200]
    bar = figure.colorbar(image, ax=axes, location="top", shrink=0.8, aspect=40, pad=0.01, ticks=ticks, format="%d")
    bar.set_label("converged: mean sweeps per macro step (explicit: 1)")
    keys: list[Patch | Line2D] = [
        Patch(facecolor=look.face, edgecolor=look.edge, hatch=look.hatch, label=kind) for kind, look in FAILURES.items()
    ]
    keys.append(Line2D([], [], color="black", linewidth=2.0, label="theory: fails above"))
    if any(entry["marks"] for entry in described):
        keys.append(
            Line2D([], [], color="black", marker="o", markerfacecolor="white", linestyle="", label="known limit")
        )
    figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), fontsize=9, frameon=False)
    figure.suptitle(textwrap.fill(dataset.attrs["title"], TITLE_WIDTH), fontsize=12)
    return figure


def _panel(axes: Axes, panel: xr.Dataset, marks: list[list[float]]) -> QuadMesh:
    steps, strengths = panel["step"].to_numpy(), panel["strength"].to_numpy()
    verdict = panel["verdict"].to_numpy().T
    good = verdict == KINDS.index("converged")
    sweeps = np.where(good, panel["sweeps"].to_numpy().T, np.nan)
    edges = _edges(steps), _edges(strengths)
    axes.set(xscale="log", yscale="log")
    image = axes.pcolormesh(*edges, sweeps, norm=LogNorm(1.0, MOST_SWEEPS), cmap="viridis_r", rasterized=True)
    for kind, look in FAILURES.items():
        where = np.ma.masked_not_equal(verdict, KINDS.index(kind))
        axes.pcolor(*edges, where, cmap=ListedColormap([look.face]), hatch=look.hatch, edgecolor=look.edge, linewidth=0)
    axes.plot(steps, panel["limit"], color="black", linewidth=2.0)
    for step, strength in marks:
        axes.plot(step, strength, "o", color="black", markerfacecolor="white", markersize=7.0)
    axes.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])
    axes.set_title(str(panel["panel"].to_numpy()), fontsize=11)
    return image


def _edges(centres: np.ndarray) -> np.ndarray:
    """Edges (n + 1,) of cells around centres (n,) that are evenly spaced on a logarithmic axis."""
    ratio = math.sqrt(centres[1] / centres[0])
    return np.append(centres / ratio, centres[-1] * ratio)
