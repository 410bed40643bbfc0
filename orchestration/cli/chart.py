"""tca-cosim chart: work-precision diagrams."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
import xarray as xr
from rich.progress import Progress, TaskID
from rich.table import Table

from ..scene.manipulator import ROD, THERMAL
from .console import extra, out, reported, written
from .options import Folder, Overrides
from .shown import require_models
from .workers import Workers, worker

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["command"]

RELEASE = "release"
_LIMIT = "CPU time [s] after which a point counts as failed; 20 times that for scipy and for the model selection"


def command(
    scenes: Annotated[
        list[str],
        typer.Argument(metavar="SCENE...", help="Names or files of scenes, or `release` for rods of other codes"),
    ],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    repeats: Annotated[int, typer.Option(min=1, help="Number of rounds; each point is timed once in each")] = 7,
    limit: Annotated[float, typer.Option(min=0.1, help=_LIMIT)] = 3.0,
    panel: Annotated[
        list[str], typer.Option(help="Panels to draw: solvers, integrators, coupling, levels; default: all")
    ] = [],  # noqa: B006
    series: Annotated[Path | None, typer.Option(help="File of series; default: that of the package")] = None,
    picture: Annotated[Path | None, typer.Option(help="Folder of the PNG files; default: that of --out")] = None,
    workers: Workers = 0,
) -> None:
    """Draws errors over CPU time of all solvers (requires tca-cosim[chart]).

    Errors are measured against a refined monolith, times are those of warm runs in one thread. Writes
    chart_NAME_PANEL.png and .svg, chart_NAME.csv and .nc.
    """
    with reported():
        with extra("chart"):
            from .. import results
            from ..benchmarks import work_precision
        if RELEASE in scenes:
            _release(folder, picture, repeats)
        names = [name for name in scenes if name != RELEASE]
        for name in names:
            require_models("chart", name, override, (THERMAL, ROD))
        file: dict[str, Any] = {"file": series} if series else {}
        with Progress(*Progress.get_default_columns(), console=out.console, transient=True) as bar:
            task = bar.add_task("references", total=2 * len(names))
            references = work_precision.reference_solutions(names, override, **_spread(workers, bar, task), **file)
            for name, reference in zip(names, references, strict=True):
                task = bar.add_task(reference.scene.name, total=1.0)
                move = lambda share, task=task: bar.update(task, completed=share)  # noqa: E731
                table = work_precision.run_chart(
                    name, override, repeats, limit, panel, reference=reference, progress=move, **file
                )
                stem = f"chart_{reference.scene.name}"
                results.write(table, folder / f"{stem}.nc")
                work_precision.write_csv(table, folder / f"{stem}.csv")
                out.print(_fastest(reference.scene.name, table))
                written(folder / f"{stem}.nc", ".csv", *_panels_drawn(table, folder, picture, stem))


def _spread(workers: int | None, bar: Progress, task: TaskID) -> dict[str, Any]:
    """Return where reference solutions are computed and how the bar follows: continuously here, else one by one."""
    if workers == 0:
        return {"progress": lambda number, share: bar.update(task, completed=number + share)}
    return {"worker": worker(None, workers, lambda _: bar.advance(task))}


def _panels_drawn(table: xr.Dataset, folder: Path, pictures: Path | None, stem: str) -> list[Path]:
    """Draw a figure for each panel; the files."""
    from ..benchmarks.work_precision import plot

    figures = {f"{stem}_{panel}": plot.draw(table, panel) for panel in plot.panels(table)}
    return [path for name, figure in figures.items() for path in _drawn(figure, folder, pictures, name)]


def _drawn(figure: Figure, folder: Path, pictures: Path | None, stem: str) -> list[Path]:
    """Save SVG beside the table and PNG there too, or in a folder of pictures; return the files."""
    from ..benchmarks.work_precision.plot import DPI
    from ..files import save_figure

    return [*save_figure(figure, folder, stem, ("svg",)), *save_figure(figure, pictures or folder, stem, ("png",), DPI)]


def _fastest(name: str, table: xr.Dataset) -> Table:
    """Return the fastest point of each solver at every accuracy, and the ratio of scipy to the faster one of ours."""
    from ..benchmarks.work_precision import fastest_points
    from ..benchmarks.work_precision.table import LEVELS

    heads = ("error <=", "ours", "auto", "paper's", "monolith", "scipy", "scipy/ours")
    shown = Table(*heads, title=f"{name}: fastest warm run, CPU time [ms]")
    for level in LEVELS:
        times = {solver: float(table["time"][k]) for solver, k in fastest_points(table, level).items()}
        solvers = ("cosimulation", "auto", "paper's scheme", "monolith", "reference")
        cells = [f"{1e3 * times[s]:.2f}" if s in times else "-" for s in solvers]
        ours = [times[solver] for solver in ("cosimulation", "auto") if solver in times]
        ratio = f"{times['reference'] / min(ours):.0f}" if ours and "reference" in times else "-"
        shown.add_row(f"{level:g}", *cells, ratio)
    return shown


def _release(folder: Path, pictures: Path | None, repeats: int) -> None:
    from ..benchmarks import peers
    from ..benchmarks.work_precision.release import draw

    rows, notes = peers.compare_peers(repeats)
    peers.write(rows, notes, folder / "chart_release.csv")
    written(folder / "chart_release.csv", *_drawn(draw(rows, notes), folder, pictures, "chart_release"))
