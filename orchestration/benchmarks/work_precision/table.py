"""The table of a chart: a Dataset over its points, with everything needed to measure them again."""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ... import results
from ...results.provenance import commit, machine
from ...scene import Scene
from .measure import MeasuredPoint
from .norm import ErrorNorm, pareto_front
from .series import ChartPlan
from .solvers import SOLVERS

__all__ = ["LEVELS", "chart_table", "fastest_points", "write_csv"]

LEVELS = (1e-2, 1e-3, 1e-4, 1e-5)  # errors at which the fastest points are compared, share of the range
_COLUMNS: dict[str, tuple[str, str]] = {
    "series": ("1", "name of the series"),
    "panel": ("1", "panel of the chart"),
    "solver": ("1", f"one of {', '.join(SOLVERS)}"),
    "settings": ("1", "overrides of the scene, settings of the solver"),
    "error": ("1", "RMS over times and quantities, each over its range; inf: failed"),
    "time": ("s", "CPU time of a warm run, median"),
    "time_low": ("s", "its first quartile"),
    "time_high": ("s", "its third quartile"),
    "runs": ("1", "warm runs"),
    "cold": ("s", "CPU time from the scene's file to the end of the first run"),
    "work": (
        "1",
        "evaluations of the rod: residuals, also of repeated steps; right-hand sides; shots; nan: none counted",
    ),
    "front": ("1", "whether no other point is both faster and as exact"),
    "failure": ("1", "why it failed"),
}


def chart_table(
    scene: Scene, plan: ChartPlan, points: list[MeasuredPoint], norm: ErrorNorm, floor: float, repeats: int
) -> xr.Dataset:
    """The table of measured points; floor: error of the coarse reference against the fine one."""
    times = np.array([np.quantile(p.warm, (0.25, 0.5, 0.75)) if p.warm else [np.nan] * 3 for p in points])
    error = np.array([p.error for p in points])
    columns: dict[str, Any] = {
        "series": [p.trial.series for p in points],
        "panel": [p.trial.panel for p in points],
        "solver": [p.trial.solver for p in points],
        "settings": [p.trial.swept for p in points],
        "error": error,
        "time": times[:, 1],
        "time_low": times[:, 0],
        "time_high": times[:, 2],
        "runs": [len(p.warm) for p in points],
        "cold": [p.cold for p in points],
        "work": [p.work for p in points],
        "front": pareto_front(error, times[:, 1]),
        "failure": [p.reason for p in points],
    }
    attributes = {name: {"units": unit, "long_name": text} for name, (unit, text) in _COLUMNS.items()}
    dataset = xr.Dataset({name: ("point", values, attributes[name]) for name, values in columns.items()})
    packages = {name: version(name) for name in ("scipy", "scikit-fem", "scikit-sundae", "threadpoolctl")}
    record = results.scene_record(scene, "complete")
    dataset.attrs = {
        **record,
        "versions": json.dumps({**json.loads(record["versions"]), **packages}),
        "axis": norm.axis(),
        "ranges": json.dumps(norm.ranges),
        "outputs": norm.times.size - 1,
        "floor": floor,
        "reference": json.dumps(plan.reference),
        "panels": json.dumps(plan.panels),
        "repeats": repeats,
        "fmus": json.dumps({m.name: m.archive.digest for m in scene.members}),
        "commit": commit(),
        "machine": json.dumps(machine()),
    }
    return dataset


def fastest_points(dataset: xr.Dataset, level: float) -> dict[str, int]:
    """Index of the fastest point of each solver with an error of at most `level`; the paper's scheme counts as one."""
    fastest: dict[str, int] = {}
    times = dataset["time"].to_numpy()
    for k in np.flatnonzero((dataset["error"].to_numpy() <= level) & np.isfinite(times)):
        series, solver = str(dataset["series"][k].item()), str(dataset["solver"][k].item())
        name = "paper's scheme" if series.startswith("paper's") else solver
        if name not in fastest or times[k] < times[fastest[name]]:
            fastest[name] = int(k)
    return fastest


def write_csv(dataset: xr.Dataset, path: Path) -> None:
    """Write a CSV file: the attributes as comments, then one row per point."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"# {key}: {value}\n" for key, value in dataset.attrs.items())
        table: pd.DataFrame = dataset.to_dataframe()
        table.columns = [f"{name} [{_COLUMNS[str(name)][0]}]" for name in table.columns]
        table.to_csv(file, index=False, lineterminator="\n")
