"""A sweep, run: points that no earlier process finished, then everything as one labelled Dataset."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from ... import results
from ...parallel import Worker, serial
from .plan import Plan
from .sensitivity import rank_correlation, sobol_indices
from .store import Store
from .task import Outcome, Point

__all__ = ["Progress", "run"]


@dataclass(frozen=True)
class Progress:
    found: int  # runs that were finished before
    done: int  # runs that were finished now
    total: int


def run(
    plan: Plan,
    path: Path,
    worker: Worker[Outcome] = serial,
    progress: Callable[[Progress], None] = lambda progress: None,
) -> xr.Dataset:
    """path: of the file that keeps finished runs; the same plan finds them there again. Runs that fail are rows with
    their message. Raises CosimError where the file is of another sweep."""
    points = plan.points()
    with Store(path, plan.identity(), plan.times.size) as store:
        outcomes = store.outcomes()
        missing = [point for point in dict.fromkeys(points) if point not in outcomes]
        total = len(set(points))
        progress(Progress(total - len(missing), 0, total))
        tasks = [Point(plan.source, plan.overrides, point, plan.outputs, plan.times) for point in missing]
        for done, (_, outcome) in enumerate(worker(tasks), 1):
            store.add(outcome)
            outcomes[outcome.point] = outcome
            progress(Progress(total - len(missing), done, total))
    return _dataset(plan, [outcomes[point] for point in points])


def _dataset(plan: Plan, outcomes: list[Outcome]) -> xr.Dataset:
    """Outputs (run, time, ...) with parameters as coordinates of run; per output NAME.quantile (quantile, time, ...),
    NAME.rank_correlation and, from design `saltelli`, NAME.first_order, NAME.total_order (parameter, time, ...)."""
    columns = plan.columns()
    width = sum(int(np.prod(shape)) for _, shape, _ in columns.values())
    absent = np.full((plan.times.size, width), np.nan)
    runs = np.array([absent if o.series is None else o.series for o in outcomes])
    names = [axis.name for axis in plan.axes]
    dataset = xr.Dataset(
        {"failure": ("run", [o.failure for o in outcomes], {"long_name": "why a run failed; empty where it did not"})},
        {
            "run": ("run", np.arange(len(outcomes)), {"units": "1", "long_name": "number of the run"}),
            "time": ("time", plan.times, {"units": "s", "long_name": "time"}),
            "quantile": ("quantile", np.array(plan.quantiles), {"units": "1", "long_name": "share of runs below"}),
            "parameter": ("parameter", names, {"long_name": "name of a parameter"}),
            **{name: _coordinate(plan, k) for k, name in enumerate(names)},
        },
        _about(plan, outcomes),
    )
    begin = 0
    for name, (dims, shape, about) in columns.items():
        end = begin + int(np.prod(shape))
        values = runs[:, :, begin:end]
        begin = end
        dataset[name] = ("run", "time", *dims), values.reshape(*values.shape[:2], *shape), about
        for key, (first, array, attributes) in _statistics(plan, values, about).items():
            dataset[f"{name}.{key}"] = (first, "time", *dims), array.reshape(*array.shape[:2], *shape), attributes
    return dataset


def _coordinate(plan: Plan, k: int) -> tuple[str, np.ndarray, dict[str, str]]:
    about = plan.axes[k].variable
    return "run", np.array([row[k] for row in plan.values]), {"units": about.unit, "long_name": about.description}


def _statistics(
    plan: Plan, values: np.ndarray, about: dict[str, str]
) -> dict[str, tuple[str, np.ndarray, dict[str, str]]]:
    """values: (run, time, element). Of runs that did not fail; lists of values are ranked in the order given."""
    good = ~np.isnan(values).all(axis=(1, 2))
    flat = values.reshape(len(values), -1)
    shape = (len(plan.axes), *values.shape[1:])
    ranked = [
        [axis.values.index(v) if axis.values else v for axis, v in zip(plan.axes, row, strict=True)]
        for row in plan.values
    ]
    quantiles = (
        np.quantile(values[good], plan.quantiles, axis=0)
        if good.any()
        else np.full((len(plan.quantiles), *values.shape[1:]), np.nan)
    )
    text = about["long_name"]
    found = {
        "quantile": ("quantile", quantiles, {"units": about["units"], "long_name": f"quantiles: {text}"}),
        "rank_correlation": (
            "parameter",
            rank_correlation(np.array(ranked, dtype=float)[good], flat[good]).reshape(shape),
            {"units": "1", "long_name": f"rank correlation with a parameter: {text}"},
        ),
    }
    if plan.settings.design == "saltelli":
        for key, array in zip(("first_order", "total_order"), sobol_indices(len(plan.axes), flat), strict=True):
            words = {"units": "1", "long_name": f"Sobol' index, {key.replace('_', ' ')}: {text}"}
            found[key] = ("parameter", array.reshape(shape), words)
    return found


def _about(plan: Plan, outcomes: list[Outcome]) -> dict[str, object]:
    failed = sum(bool(o.failure) for o in outcomes)
    return {
        **results.scene_record(plan.scene, "complete" if not failed else f"{failed} of {len(outcomes)} runs failed"),
        "title": plan.title,
        "sweep": plan.name,
        "set": json.dumps(plan.overrides),
        "design": json.dumps(asdict(plan.settings)),
        "parameters": json.dumps({a.name: a.values or {a.law: dict(a.arguments)} for a in plan.axes}),
    }
