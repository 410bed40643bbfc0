"""Figure of a sweep: for each output the bands between quantiles over time and the sensitivities at the end."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...plotting import display_unit, element_labels, grid, series_colour

__all__ = ["draw", "outputs"]

MOST_CURVES = 6  # largest number of elements of an output that one panel shows


def outputs(dataset: xr.Dataset) -> tuple[list[str], list[str]]:
    """Names of the outputs that are drawn, and of those that have too many elements."""
    names = [str(name) for name in dataset.data_vars if f"{name}.quantile" in dataset]
    curves = {name: int(np.prod(dataset[name].shape[2:])) for name in names}
    return [n for n in names if curves[n] <= MOST_CURVES], [n for n in names if curves[n] > MOST_CURVES]


def draw(dataset: xr.Dataset) -> Figure:
    """Draw the dataset of run_sweep()."""
    names, _ = outputs(dataset)
    rows = max(1, len(names))
    figure = Figure(figsize=(9.6, 3.0 * rows + 0.6), layout="constrained")
    axes = figure.subplots(rows, 2, squeeze=False, width_ratios=(3, 2))
    for panel in axes.flat:
        panel.set_visible(bool(names))
    for (left, right), name in zip(axes, names, strict=False):
        _bands(left, dataset, name)
        _sensitivities(right, dataset, name)
    if names:
        axes[-1, 0].set_xlabel("time [s]")
        axes[0, 1].set_title(f"at {float(dataset['time'][-1]):g} s", fontsize=10)
    failed = int((dataset["failure"] != "").sum())
    shares = ", ".join(f"{100 * float(q):g}" for q in dataset["quantile"])
    figure.suptitle(
        f"{dataset.attrs['title']}: {dataset.sizes['run']} runs, {failed} failed; quantiles {shares} %", fontsize=11
    )
    return figure


def _flat(dataset: xr.Dataset, name: str) -> np.ndarray:
    """Values with all indices of a vector as one: (first, time, element)."""
    array = dataset[name].to_numpy()
    return array.reshape(*array.shape[:2], -1)


def _bands(axes: Axes, dataset: xr.Dataset, name: str) -> None:
    curves = _flat(dataset, f"{name}.quantile")
    time, count, half = dataset["time"].to_numpy(), curves.shape[2], len(curves) // 2
    unit, labels = display_unit(dataset[name].attrs["units"]), element_labels(name, count)
    curves = unit.convert(curves)
    for k in range(count):
        for low, high in zip(curves[:half], curves[::-1][:half], strict=True):
            axes.fill_between(time, low[:, k], high[:, k], color=series_colour(k), alpha=0.5 / half, linewidth=0.0)
        if len(curves) % 2:
            axes.plot(time, curves[half, :, k], color=series_colour(k), linewidth=1.5, label=labels[k])
    axes.set_ylabel(f"{name} [{unit.name}]")
    axes.margins(x=0.0)
    grid(axes)
    if len(curves) % 2 and count > 1:
        axes.legend(fontsize=9, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)


def _sensitivities(axes: Axes, dataset: xr.Dataset, name: str) -> None:
    """Draw a bar per parameter and element: Sobol' indices where there are any, else rank correlations."""
    parameters = [str(p) for p in dataset["parameter"].to_numpy()]
    known = f"{name}.first_order" in dataset and np.isfinite(_flat(dataset, f"{name}.first_order")[:, -1]).any()
    drawn = {"total_order": 0.35, "first_order": 1.0} if known else {"rank_correlation": 1.0}
    for key, alpha in drawn.items():
        bars = _flat(dataset, f"{name}.{key}")[:, -1]  # (parameter, element)
        height = 0.8 / bars.shape[1]
        for k in range(bars.shape[1]):
            positions = np.arange(len(parameters)) - 0.4 + (k + 0.5) * height
            axes.barh(positions, np.nan_to_num(bars[:, k]), height, color=series_colour(k), alpha=alpha)
    axes.set_yticks(range(len(parameters)), parameters, fontsize=9)
    axes.invert_yaxis()
    axes.set_xlim(*((0.0, 1.05) if known else (-1.0, 1.0)))
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_xlabel("Sobol' index, first order in total order" if known else "rank correlation", fontsize=10)
    grid(axes)
