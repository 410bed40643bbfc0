"""tca-cosim fit: no more model than a scene needs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress
from rich.table import Table

from .. import fidelity, results
from ..scene import Scene, read
from .console import out, reported, written
from .options import Folder, Overrides

__all__ = ["command", "explain"]


def command(
    scenes: Annotated[list[str], typer.Argument(metavar="SCENE...", help="Names (tca-cosim list) or files")],
    tolerances: Annotated[
        list[str],
        typer.Option("--tolerance", help="Error allowed, share of the range; default: what the scene asks"),
    ] = [],  # noqa: B006 (typer copies it)
    quantities: Annotated[
        list[str], typer.Option("--of", help="What for, such as rod.tip.p; default: what the scene asks")
    ] = [],  # noqa: B006
    override: Overrides = [],  # noqa: B006
    audit: Annotated[bool, typer.Option("--audit", help="Run the top level too, for the true error")] = False,
    study: Annotated[bool, typer.Option("--study", help="Run all levels too, for the cheapest that is enough")] = False,
    folder: Folder = Path("results"),
) -> None:
    """Chooses models no larger than a scene needs for what it asks, and says why; writes NAME.fit.nc."""
    extras = ["true error"] * (audit or study) + ["cheapest [s]", "ratio"] * study
    table = Table("scene", "tolerance", "estimate", "run [s]", "search [s]", *extras)
    asked = [f"fidelity.quantities={list(quantities)!r}"] if quantities else []
    with reported():
        for name in scenes:
            for tolerance in tolerances or [None]:
                wanted = [] if tolerance is None else [f"fidelity.tolerance={tolerance}"]
                table.add_row(*_one(read(name, [*override, *asked, *wanted]), audit, study, folder))
        out.print(table)


def explain(record: dict[str, object]) -> None:
    """The reasons of a choice, one to a line."""
    out.print(*record["reasons"], sep="\n", highlight=False, markup=False, soft_wrap=True)


def _one(scene: Scene, audit: bool, study: bool, folder: Path) -> list[str]:
    """Chooses, runs and writes; the cells of its row."""
    with Progress(*Progress.get_default_columns(), console=out, transient=True) as bar:
        task = bar.add_task(scene.name, total=None)
        found = fidelity.fit(scene, lambda choice, estimate: bar.advance(task))
        studied = fidelity.study(found, lambda done, of: bar.update(task, completed=done, total=of)) if study else None
        true = studied.chosen.error if studied else fidelity.audit(found) if audit else None
    result = found.result(true)
    results.write(result, folder / f"{scene.name}.fit.nc")
    explain(found.record(true))
    written(folder / f"{scene.name}.fit.nc")
    cost = (studied.chosen if studied else found.run).cost
    row = [
        scene.name,
        f"{scene.asked.tolerance:g}",
        f"{found.found.estimate:.2e}",
        f"{cost:.3f}",
        f"{found.search:.2f}",
    ]
    row += [] if true is None else [f"{true:.2e}"]
    return row + ([f"{studied.best.cost:.3f}", f"{studied.ratio:.2f}"] if studied else [])
