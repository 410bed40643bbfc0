"""Laid out as Fig. 3 of the paper: voltages, temperatures, angles and top view below each other, a column per scene.
Lines are computed, dots are read off the paper.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...files import save_figure
from ...scene import Scene
from . import ANGLES, SCENES, TEMPERATURES, course, deviations, readings, tips

__all__ = ["draw", "save"]

COLOURS = ("tab:blue", "tab:orange", "tab:green")
SHAPE_EVERY = 5.0  # [s] between the body shapes in the top view


def draw(scenes: Mapping[str, Scene], results: Mapping[str, xr.Dataset]) -> Figure:
    """Scenes and results: by the names in SCENES."""
    figure = Figure(figsize=(12.0, 12.5), layout="constrained")
    axes = figure.subplots(4, 3, height_ratios=(1.0, 1.6, 1.6, 2.4))
    for column, name in zip(axes.T, SCENES, strict=True):
        result, read = results[name], readings(name)
        column[0].set_title(scenes[name].title, fontsize=9)
        _voltages(column[0], result)
        _courses(column[1], result, read, TEMPERATURES, "mean temperature of the TCAs [°C]")
        _courses(column[2], result, read, ANGLES, "angles of the tip [rad]")
        _top(column[3], result, tips(name))
        temperature, angle = deviations(result, name)
        column[1].set_title(f"rms {temperature:.2f} K", fontsize=8, loc="right")
        column[2].set_title(f"rms {angle:.3f} rad", fontsize=8, loc="right")
        column[2].set_xlabel("t [s]")
    figure.suptitle("Lines: co-simulation. Dots: values read off Fig. 3 of the paper.", fontsize=10)
    return figure


def save(figure: Figure, folder: Path) -> list[Path]:
    """The files written."""
    return save_figure(figure, folder, "fig3", ("png", "svg", "pdf"))


def _voltages(axes: Axes, result: xr.Dataset) -> None:
    for k, colour in enumerate(COLOURS):
        axes.plot(result["time"], result["thermal.V"][:, k], color=colour, label=f"V{k + 1}")
    _finish(axes, "voltage [V]")


def _courses(axes: Axes, result: xr.Dataset, read: Mapping, group: tuple[str, ...], label: str) -> None:
    for series, colour in zip(group, COLOURS, strict=True):
        axes.plot(result["time"], course(result, series), color=colour, label=series)
        axes.plot(read[series].time, read[series].value, ".", color=colour, markersize=4.0, alpha=0.6)
    _finish(axes, label)


def _top(axes: Axes, result: xr.Dataset, points: np.ndarray) -> None:
    millimetres = 1e3
    shape = result["rod.shape.p"].to_numpy() * millimetres
    tip = result["rod.tip.p"].to_numpy() * millimetres
    times = result["time"].to_numpy()
    every = np.unique(np.searchsorted(times, np.arange(0.0, times[-1] + 1e-9, SHAPE_EVERY)))
    for k in every:
        axes.plot(shape[k, :, 0], shape[k, :, 1], color="0.75", linewidth=0.8, label="body" if k == 0 else None)
    axes.plot(tip[:, 0], tip[:, 1], color="black", label="tip")
    axes.plot(points[:, 1], points[:, 2], "o", color="tab:red", markersize=4.0, label="tip, paper")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [mm]")
    _finish(axes, "y [mm]")


def _finish(axes: Axes, label: str) -> None:
    axes.set_ylabel(label)
    axes.legend(fontsize=7, loc="best")
    axes.grid(alpha=0.3)
