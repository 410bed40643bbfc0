"""tca-cosim plan: voltages for a wanted path."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from .console import out, reported, written
from .options import Folder, Overrides

__all__ = ["command"]

SLOW = (
    "between two changes of the voltages loads, or vibrations, move the tip (give a smaller --step, or a slower path)"
)


def command(
    target: Annotated[
        Path, typer.Argument(metavar="TARGET", help="CSV of the path: time [s], then outputs such as tip.p[1] [mm]")
    ],
    scene: Annotated[
        str, typer.Option(help="Scene of the manipulator and its loads; its voltages are not used")
    ] = "step",
    override: Overrides = [],  # noqa: B006 (typer copies it)
    voltage: Annotated[float, typer.Option(help="Largest voltage [V]")] = 5.0,
    temperature: Annotated[float, typer.Option(help="Highest mean temperature of a TCA [degC]")] = 100.0,
    hottest: Annotated[
        float | None, typer.Option(help="Highest temperature anywhere [degC]; default: that of --temperature")
    ] = None,
    rate: Annotated[float, typer.Option(help="Fastest change of a voltage [V/s]")] = math.inf,
    distance: Annotated[float, typer.Option("--step", help="Time between changes of the voltages [s]")] = 0.5,
    folder: Folder = Path("results"),
) -> None:
    """Finds voltages with which the manipulator follows a path (requires tca-cosim[control]).

    Writes a scene that runs them and the result of the full models.
    """
    from .. import results
    from ..planning import PlanLimits, plan, read_target  # scipy takes long to load

    with reported():
        limits = PlanLimits(voltage, temperature + 273.15, (temperature if hottest is None else hottest) + 273.15, rate)
        made = plan(scene, lambda described: read_target(described, target), limits, distance, override)
        files = made.write(folder, target.stem)
        results.write(made.table, folder / f"{target.stem}.nc")
        for unit, (rms, largest) in made.errors.items():
            size, shown = (1e3, " mm") if unit == "m" else (1.0, "" if unit == "1" else f" {unit}")
            out.print(
                f"error of the path in the full models: {size * rms:.4g}{shown} rms, {size * largest:.4g}"
                f"{shown} at most, from {made.target.times[0]:g} s on",
                highlight=False,
            )
        if not made.reached:
            taken = ", ".join(f"{name} in {u}" for name, u in zip(made.target.outputs, made.target.units, strict=True))
            why = "out of reach within the limits" if made.active else "not followed, though no limit acts: " + SLOW
            out.print(
                f"note: the path is {why}; its values are {taken}, unless the file has another unit in brackets; "
                "tca-cosim workspace shows where the tip can be",
                highlight=False,
                soft_wrap=True,
            )
        if not made.keeps_limits:
            out.print(
                "note: the full models pass a limit of temperature, which the optimisation kept; their hottest point "
                f"gets {made.hottest - 273.15:.4g} degC; lower --temperature by the excess",
                highlight=False,
                soft_wrap=True,
            )
        if not made.converged:
            out.print("note: the optimisation has not converged; give a larger --step or wider limits", highlight=False)
        for text in made.active or ("no limit acts",):
            out.print(f"active: {text}" if made.active else text, highlight=False, soft_wrap=True)
        written(*files, folder / f"{target.stem}.nc")
