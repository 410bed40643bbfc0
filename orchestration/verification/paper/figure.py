"""Fig. 3 of the paper: voltages, temperatures, angles and top view of the three scenes.

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
from ...plotting import SERIES, grid, legend_above
from .data import ANGLES, SCENES, TEMPERATURES, readings
from .deviations import TipComparison, compare_tips, deviations, time_course

__all__ = ["draw", "save"]

_SHAPE_EVERY = 5.0  # [s] between the body shapes in the top view
_MILLI = 1e3
_VOLTAGES = {
    "step": "V = (0, 1.5, 3) V",
    "switch": "V₁ = 3 V, after 15 s V₂ = 3 V",
    "sine": "V = 1.5 + 1.5 sin(2πt/30 s + φ) V",
}
_NOTE = (
    "The paper's tips lie {low:.0f} to {high:.0f} % farther out than its own angles put the tip of a 40 mm body of\n"
    "the computed elongation (crosses). No stiffness explains this: the elongation would exceed the free stroke of\n"
    "the TCAs. Within the reading error of 0.5 mm all distances agree with a body that is {factor:.0f} % longer, or\n"
    "with one that is bent more near its clamp."
)


def draw(results: Mapping[str, xr.Dataset]) -> Figure:
    """Draw the figure of the results of the scenes named in SCENES."""
    figure = Figure(figsize=(10.5, 14.0), layout="constrained")
    rows = figure.subfigures(4, 1, squeeze=False, height_ratios=(1.15, 1.5, 1.5, 2.1))[:, 0]
    panels = [row.subplots(1, len(SCENES), squeeze=False)[0] for row in rows]
    tips = {name: compare_tips(results[name], name) for name in SCENES}
    for k, name in enumerate(SCENES):
        result, rms = results[name], deviations(results[name], name)
        panels[0][k].set_title(f"{name}\n{_VOLTAGES[name]}", fontsize=10)
        _draw_voltages(panels[0][k], result)
        _draw_curves(panels[1][k], result, name, TEMPERATURES, f"rms {rms.temperature:.2f} K")
        _draw_curves(panels[2][k], result, name, ANGLES, f"rms {rms.angle:.3f} rad")
        _draw_top_view(panels[3][k], result, tips[name])
    labels = ("voltage [V]", "mean temperature of the TCAs [°C]", "angles of the tip [rad]", "top view, y [mm]")
    for row, axes, label in zip(rows, panels, labels, strict=True):
        axes[0].set_ylabel(label)
        legend_above(row, axes[0])
    figure.suptitle("Fig. 3 of the paper: lines computed, dots read off the figure", fontsize=13)
    figure.supxlabel(_note([tip for scene in tips.values() for tip in scene]), fontsize=10, x=0.02, ha="left")
    return figure


def save(figure: Figure, folder: Path) -> list[Path]:
    """Write fig3.png, .svg and .pdf into a folder and return their paths."""
    return save_figure(figure, folder, "fig3", ("png", "svg", "pdf"))


def _note(tips: list[TipComparison]) -> str:
    """Explanation of the deviation of the tips."""
    factors = np.array([(1.0 + tip.elongation_read) / (1.0 + tip.elongation) for tip in tips])
    shares = 100.0 * (factors - 1.0)
    return _NOTE.format(low=shares.min(), high=shares.max(), factor=shares.mean())


def _draw_voltages(axes: Axes, result: xr.Dataset) -> None:
    for k, values in enumerate(result["thermal.V"].to_numpy().T):
        axes.plot(result["time"], values, color=SERIES[k], label=f"TCA {k + 1}")
    axes.set_ylim(-0.15, 3.15)
    axes.set_xlabel("t [s]")
    grid(axes)


def _draw_curves(axes: Axes, result: xr.Dataset, scene: str, group: tuple[str, ...], title: str) -> None:
    points = readings(scene)
    for series, colour in zip(group, SERIES, strict=False):
        axes.plot(result["time"], time_course(result, series), color=colour, label=series)
        axes.plot(points[series].time, points[series].value, ".", color=colour, markersize=4.0, alpha=0.6)
    axes.set_title(title, fontsize=10, loc="right")
    axes.set_xlabel("t [s]")
    grid(axes)


def _draw_top_view(axes: Axes, result: xr.Dataset, tips: list[TipComparison]) -> None:
    shape, tip = (_MILLI * result[f"rod.{name}"].to_numpy() for name in ("shape.p", "tip.p"))
    times = result["time"].to_numpy()
    for row in np.unique(np.searchsorted(times, np.arange(0.0, times[-1] + 1e-9, _SHAPE_EVERY))):
        axes.plot(*shape[row, :, :2].T, color="0.7", linewidth=0.9, label="body every 5 s" if row == 0 else None)
    axes.plot(*tip[:, :2].T, color="black", label="path of the tip")
    read = np.array([[one.read.x, one.read.y] for one in tips])
    axes.plot(*read.T, "o", color=SERIES[1], markersize=6.0, label="tip, paper")
    moved = np.array([one.from_angles for one in tips])
    axes.plot(*moved.T, "x", color=SERIES[0], markersize=7.0, label="tip by the paper's angles")
    for one in tips:
        axes.plot(
            *np.transpose([one.computed, [one.read.x, one.read.y]]), color=SERIES[1], linewidth=1.0, linestyle=":"
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title(f"off by {', '.join(f'{one.distance:.1f}' for one in tips)} mm", fontsize=10, loc="right")
    axes.set_xlabel("x [mm]")
    grid(axes)
