"""tca-cosim sweep: a scene with varied parameters."""

from __future__ import annotations

import time
import warnings
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import xarray as xr
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.table import Table

from .. import results
from ..errors import FmuWarning
from ..files import save_figure
from .console import out, reported, written
from .options import Folder, Overrides
from .workers import Scheduler, Workers, worker

__all__ = ["command"]


def command(
    plan: Annotated[str, typer.Argument(metavar="SWEEP", help="Name of a sweep (tca-cosim list) or a .toml file")],
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    runs: Annotated[
        int | None, typer.Option(min=1, max=1_000_000, help="Number of runs; default: that of the file")
    ] = None,
    scheduler: Scheduler = None,
    workers: Workers = None,
) -> None:
    """Runs a scene many times with parameters from distributions or lists (requires tca-cosim[sweep]).

    An interrupted sweep resumes; completed runs are reused. Writes NAME.sweep.nc, .png, .svg.
    """
    from ..studies import sweep  # scipy.stats takes long to load

    with reported():
        described = sweep.read_plan(plan, runs, override)
        name = f"{described.name}.sweep"
        begin = time.perf_counter()
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]:.1f} runs/s"),
            TimeRemainingColumn(),
        )
        with Bar(*columns, console=out.console, transient=True) as bar:
            task = bar.add_task(described.name, total=None, rate=0.0)
            state = sweep.SweepProgress(0, 0, 0)

            def advance(now: sweep.SweepProgress) -> None:
                nonlocal state
                state = now
                rate = now.done / (time.perf_counter() - begin)
                bar.update(task, completed=now.reused + now.done, total=now.total, rate=rate)

            threads = 0 if scheduler else max(1, workers) if workers is not None else None
            dataset = sweep.run_sweep(
                described, folder / f"{name}.sqlite", worker(scheduler, workers), advance, threads
            )
        spent = time.perf_counter() - begin
        results.write(dataset, folder / f"{name}.nc")
        save_figure(sweep.chart.draw(dataset), folder, name)
        out.print(
            f"{described.title}: {state.total} runs, {state.reused} finished before, {state.done} now in {spent:.1f} s "
            f"({state.done / spent:.1f} runs/s)",
            highlight=False,
        )
        _summarise(dataset, sweep.chart.outputs(dataset))
        written(folder / f"{name}.nc", ".png", ".svg")


def _summarise(dataset: xr.Dataset, outputs: tuple[list[str], list[str]]) -> None:
    """Print quantiles and the most influential parameter at the end, failures and warnings."""
    from ..engine.batch import summary_of_warnings
    from ..plotting import display_unit

    shown, crowded = outputs
    last = dataset.isel(time=-1)
    count = dataset.sizes["quantile"]
    kept = sorted({0, count // 2, count - 1})
    table = Table("at the end", *(f"{100 * float(dataset['quantile'][q]):g} %" for q in kept), "rank correlation")
    for name in shown:
        quantiles = last[f"{name}.quantile"].to_numpy().reshape(count, -1)
        ranks = last[f"{name}.rank_correlation"].to_numpy().reshape(dataset.sizes["parameter"], -1)
        for k, (column, rank) in enumerate(zip(quantiles.T, ranks.T, strict=True)):
            best = int(np.argmax(np.nan_to_num(np.abs(rank), nan=-1.0)))
            label = f"{name}[{k + 1}]" if quantiles.shape[1] > 1 else name
            unit = display_unit(dataset[name].attrs["units"])
            most = f"{rank[best]:+.2f} {dataset['parameter'].to_numpy()[best]}"
            shown_values = unit.convert(column)
            table.add_row(f"{label} [{unit.name}]", *(f"{shown_values[q]:.5g}" for q in kept), most)
    out.print(table)
    if crowded:
        out.print(f"not drawn, too many elements: {', '.join(crowded)}", highlight=False)
    failures = [text for text in dataset["failure"].to_numpy() if text]
    if failures:
        out.print(f"{len(failures)} runs failed, the first with: {failures[0]}", highlight=False)
    if text := summary_of_warnings(dataset["warning"].to_numpy().tolist()):
        warnings.warn(text, FmuWarning, stacklevel=2)
