"""tca-cosim linearise: a linear model of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from .console import out, reported, written
from .options import Folder, Overrides, SceneName

__all__ = ["command"]


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    at: Annotated[float, typer.Option("--time", min=0.0, help="Time of the operating point [s]")] = 0.0,
    inputs: Annotated[
        list[str] | None, typer.Option("--input", help="Input 'fmu.variable', again for more; default: all")
    ] = None,
    outputs: Annotated[
        list[str] | None, typer.Option("--output", help="Output 'fmu.variable', again for more; default: all")
    ] = None,
    order: Annotated[
        int | None, typer.Option(min=1, help="Number of states to reduce the model to, by balanced truncation")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(help="Reduces to this error instead, a share of the largest Hankel singular value"),
    ] = None,
    folder: Folder = Path("results"),
) -> None:
    """Linearises a scene where it stands at a time.

    Writes A, B, C, D with names and units as NAME.linear.npz, .mat and .json.
    """
    from ..linear import balanced_truncation, linearise, save  # scipy takes long to load
    from ..linear.storage import ENDINGS

    with reported():
        model = linearise(scene, at, override).select(inputs or (), outputs or ())
        if order is not None or tolerance is not None:
            model = balanced_truncation(model, order, tolerance)
        table = Table("pole [1/s]", "time constant [s]", "frequency [Hz]", "damping ratio")
        for pole in [pole for pole in model.poles() if pole.imag >= 0.0][:SHOWN_POLES]:
            size = abs(pole)
            table.add_row(
                f"{pole:.5g}" if pole.imag else f"{pole.real:.5g}",
                f"{-1.0 / pole.real:.4g}" if pole.real < 0.0 else "",
                f"{size / 6.283185307179586:.4g}" if pole.imag else "",
                f"{-pole.real / size:.3g}" if pole.imag else "",
            )
        out.print(table)
        out.print(
            f"{len(model.states)} states, {len(model.inputs)} inputs, {len(model.outputs)} outputs at t = "
            f"{model.time:.6g} s",
            highlight=False,
        )
        for note in model.notes:
            out.print(f"note: {note}", highlight=False, soft_wrap=True)
        for ending in ENDINGS:
            path = folder / f"{model.scene}.linear{ending}"
            save(model, path)
            written(path)


SHOWN_POLES = 8  # of the table, the slowest
