"""tca-cosim select: the cheapest models that meet a tolerance."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from .. import results
from ..scene import Scene, read
from ..studies import model_selection
from .console import busy, out, reported, written
from .options import Folder, Overrides

__all__ = ["command", "explain"]


def command(
    scenes: Annotated[list[str], typer.Argument(metavar="SCENE...", help="Names or files of scenes")],
    tolerances: Annotated[
        list[str],
        typer.Option("--tolerance", help="Allowed error, share of the range; default: that of the scene"),
    ] = [],  # noqa: B006 (typer copies it)
    quantities: Annotated[
        list[str],
        typer.Option("--of", help="Quantity whose error counts, such as rod.tip.p; default: those of the scene"),
    ] = [],  # noqa: B006
    override: Overrides = [],  # noqa: B006
    audit: Annotated[bool, typer.Option("--audit", help="True error, from a run of the finest models")] = False,
    study: Annotated[
        bool, typer.Option("--study", help="True cost, from runs of all models that are not more expensive")
    ] = False,
    folder: Folder = Path("results"),
) -> None:
    """Selects the cheapest models whose estimated error meets the tolerance, with the reasons.

    Writes NAME.select.nc, with several tolerances NAME.select.TOLERANCE.nc.
    """
    extras = ["true error"] * (audit or study) + ["least\n[s]", "ratio"] * study
    table = Table("scene", "asked", "estimate", "run\n[s]", "search\n[s]", *extras)  # 80 columns hold all
    asked = [f"fidelity.quantities={list(quantities)!r}"] if quantities else []
    wanted = [[f"fidelity.tolerance={tolerance}"] for tolerance in tolerances] or [[]]
    with reported():
        for name in scenes:
            for row in _rows([read(name, [*override, *asked, *each]) for each in wanted], audit, study, folder):
                table.add_row(*row)
        out.print(table)


def explain(record: dict[str, Any]) -> None:
    """Print the reasons of a selection, one per line."""
    out.print(*record["reasons"], sep="\n", highlight=False, soft_wrap=True)


def _rows(scenes: list[Scene], audit: bool, study: bool, folder: Path) -> Iterator[list[str]]:
    """Select, run and write for one scene and several tolerances; yield the cells of each row."""
    with busy(scenes[0].name) as show:
        selections = [model_selection.select(scene, show) for scene in scenes]
        show("the finest models")
        studies = (
            model_selection.cost_study(selections, lambda done, count: show(f"choice {done + 1} of {count}"))
            if study
            else []
        )
        errors: list[float | None] = [j.chosen.error for j in studies] or [
            model_selection.audit(s) if audit else None for s in selections
        ]
    for selection, true, costs in zip_longest(selections, errors, studies):
        asked = selection.scene.accuracy.tolerance
        path = folder / (
            f"{selection.scene.name}.select.nc" if len(scenes) == 1 else f"{selection.scene.name}.select.{asked:g}.nc"
        )
        results.write(selection.result(true), path)
        explain(selection.record(true))
        written(path)
        cost = (costs.chosen if costs else selection.run).cost
        row = [
            selection.scene.name,
            f"{asked:g}",
            f"{selection.search.estimate:.2e}",
            f"{cost:.2g}",
            f"{selection.search_time:.2g}",
        ]
        row += [] if true is None else [f"{true:.2e}"]
        yield row + ([f"{costs.best.cost:.2g}", f"{costs.ratio:.2f}"] if costs else [])
