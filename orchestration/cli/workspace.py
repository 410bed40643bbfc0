"""tca-cosim workspace: where the tip can be."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from .console import out, reported, written
from .options import Folder, Overrides, SceneName

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..planning import Workspace

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    voltage: Annotated[float, typer.Option(help="Largest voltage [V]")] = 5.0,
    temperature: Annotated[float, typer.Option(help="Highest mean temperature of a TCA [degC]")] = 100.0,
    points: Annotated[int, typer.Option(min=2, help="Number of powers of each TCA")] = 9,
    folder: Folder = Path("results"),
) -> None:
    """Maps where constant voltages bring the tip, and how fast it can move there.

    Writes NAME.workspace.csv and .png.
    """
    from ..api import read
    from ..files import atomic_write, save_figure
    from ..planning import PlanLimits, workspace

    with reported():
        described = read(scene, override)
        limits = PlanLimits(voltage, temperature + 273.15, temperature + 273.15)
        area = workspace(described, limits, points)
        path = folder / f"{described.name}.workspace.csv"
        n = area.temperatures.shape[1]
        head = [f"T[{i + 1}] [degC]" for i in range(n)] + ["x [mm]", "y [mm]", "z [mm]", "speed [mm/s]"]
        rows = np.column_stack([area.temperatures - 273.15, 1e3 * area.tips, 1e3 * area.speeds])
        with atomic_write(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file)
            table.writerow(head)
            table.writerows([f"{value:.6g}" for value in row] for row in rows)
        radius = 1e3 * np.hypot(area.tips[:, 0], area.tips[:, 1])
        out.print(
            f"{len(rows)} equilibria: up to {radius.max():.3g} mm from the axis; speed in every direction "
            f"{1e3 * area.speeds.min():.3g} to {1e3 * area.speeds.max():.3g} mm/s",
            highlight=False,
        )
        written(path, *save_figure(_figure(area), folder, f"{described.name}.workspace", ("png",)))


def _figure(area: Workspace) -> Figure:
    """Draw the tips seen from above, coloured by speed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.5, 4.5), layout="constrained")
    axes = figure.subplots()
    drawn = axes.scatter(1e3 * area.tips[:, 0], 1e3 * area.tips[:, 1], c=1e3 * area.speeds, s=14)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    figure.colorbar(drawn, label="speed in every direction [mm/s]")
    return figure
