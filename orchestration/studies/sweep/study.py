"""Execution of a sweep: runs that no earlier process completed, then all runs as one labelled Dataset."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ... import results
from ...parallel import Worker, serial
from ..many_runs import EngineRuns
from .plan import OutputColumns, SweepPlan
from .sensitivity import rank_correlation, sobol_indices
from .store import Store
from .task import RunOutcome, SweepTask, series_at

__all__ = ["SweepProgress", "run_sweep"]


@dataclass(frozen=True)
class SweepProgress:
    """How far a sweep is, in runs."""

    reused: int  # completed by an earlier process
    done: int  # completed by this one
    total: int


def run_sweep(
    plan: SweepPlan,
    path: Path,
    worker: Worker[RunOutcome] = serial,
    progress: Callable[[SweepProgress], None] = lambda progress: None,
    threads: int | None = None,
) -> xr.Dataset:
    """Run a sweep, or resume it.

    Parameters
    ----------
    plan : SweepPlan
        What is run.
    path : Path
        File that keeps completed runs; the same plan reuses them.
    worker : Worker
        Executes the runs that the engine cannot do: parallel.serial here, or spread over processes.
    progress : callable
        Called with the progress at the start and after every run, or block of runs.
    threads : int, optional
        Number of threads of the engine; default: one for each core, 0: no engine.

    Returns
    -------
    Dataset
        Outputs (run, time, ...) with the parameters as coordinates of run, quantiles and sensitivities. A run that
        fails is a row of nan with its message in `failure`; what FMUs warned of is in `warning`.

    Raises
    ------
    CosimError
        Where the file belongs to another sweep.
    """
    overrides = plan.run_overrides()
    with Store(path, plan.identity(), plan.times.size) as store:
        outcomes = store.outcomes()
        missing = [run for run in dict.fromkeys(overrides) if run not in outcomes]
        total = len(set(overrides))
        progress(SweepProgress(total - len(missing), 0, total))
        done = 0
        for block in _blocks(plan, dict(zip(overrides, plan.values, strict=True)), missing, worker, threads):
            store.add(block)
            outcomes |= {outcome.overrides: outcome for outcome in block}
            done += len(block)
            progress(SweepProgress(total - len(missing), done, total))
    return _dataset(plan, [outcomes[run] for run in overrides])


def _blocks(
    plan: SweepPlan,
    values: Mapping[tuple[str, ...], Sequence[Any]],
    missing: Sequence[tuple[str, ...]],
    worker: Worker[RunOutcome],
    threads: int | None,
) -> Iterator[list[RunOutcome]]:
    """Yield the outcomes of the runs that are missing, in blocks: those of the engine, then those of the worker.

    values: of the parameters by the overrides of a run.
    """
    left: list[tuple[str, ...]] = []
    columns = {p.name: [values[run][k] for run in missing] for k, p in enumerate(plan.parameters)}
    single = all("," not in name for name in columns)  # parameters of one value are left to the master
    engine = EngineRuns.of(plan.scene, columns, plan.outputs, threads) if missing and single and threads != 0 else None
    if engine is None:
        left = list(missing)
    else:
        order = np.concatenate([np.r_[engine.plan.outputs[name]] for name in plan.outputs])
        for block in engine.blocks(np.array(list(columns.values()), dtype=float).T):
            left += [missing[run.number] for run in block if run.rows is None]
            yield [
                RunOutcome(
                    missing[run.number],
                    series_at(plan.times, engine.plan.times, run.rows[:, order]),
                    warning=run.warning,
                )
                for run in block
                if run.rows is not None
            ]
    tasks = [SweepTask(plan.source, plan.overrides, run, plan.outputs, plan.times) for run in left]
    for _, outcome in worker(tasks) if tasks else ():
        yield [outcome]


def _dataset(plan: SweepPlan, outcomes: list[RunOutcome]) -> xr.Dataset:
    """The labelled Dataset of all runs.

    For each output NAME (run, time, ...) also NAME.quantile (quantile, time, ...), NAME.rank_correlation and, from
    design `saltelli`, NAME.first_order, NAME.total_order (parameter, time, ...).
    """
    columns = plan.columns()
    width = sum(output.count for output in columns.values())
    absent = np.full((plan.times.size, width), np.nan)
    runs = np.array([absent if o.series is None else o.series for o in outcomes])
    names = [parameter.name for parameter in plan.parameters]
    dataset = xr.Dataset(
        {
            "failure": ("run", [o.failure for o in outcomes], {"long_name": "why a run failed; else empty"}),
            "warning": ("run", [o.warning for o in outcomes], {"long_name": "what FMUs warned of; else empty"}),
        },
        {
            "run": ("run", np.arange(len(outcomes)), {"units": "1", "long_name": "number of the run"}),
            "time": ("time", plan.times, {"units": "s", "long_name": "time"}),
            "quantile": ("quantile", np.array(plan.quantiles), {"units": "1", "long_name": "share of runs below"}),
            "parameter": ("parameter", names, {"long_name": "name of a parameter"}),
            **{name: _coordinate(plan, k) for k, name in enumerate(names)},
        },
        _attributes(plan, outcomes),
    )
    begin = 0
    for name, output in columns.items():
        end = begin + output.count
        values = runs[:, :, begin:end]
        begin = end
        dims, shape = output.dims, output.shape
        dataset[name] = ("run", "time", *dims), values.reshape(*values.shape[:2], *shape), output.attributes
        for key, (first, array, attributes) in _statistics(plan, values, output).items():
            dataset[f"{name}.{key}"] = (first, "time", *dims), array.reshape(*array.shape[:2], *shape), attributes
    return dataset


def _coordinate(plan: SweepPlan, k: int) -> tuple[str, np.ndarray, dict[str, str]]:
    variable = plan.parameters[k].variable
    return "run", np.array([row[k] for row in plan.values]), {"units": variable.unit, "long_name": variable.description}


def _statistics(
    plan: SweepPlan, values: np.ndarray, output: OutputColumns
) -> dict[str, tuple[str, np.ndarray, dict[str, str]]]:
    """Quantiles and sensitivities of one output over the runs that did not fail.

    values: (run, time, element). Values of a list are ranked in the order of the list.
    """
    good = ~np.isnan(values).all(axis=(1, 2))
    flat = values.reshape(len(values), -1)
    shape = (len(plan.parameters), *values.shape[1:])
    ranked = [
        [p.values.index(v) if p.values else v for p, v in zip(plan.parameters, row, strict=True)] for row in plan.values
    ]
    quantiles = (
        np.quantile(values[good], plan.quantiles, axis=0)
        if good.any()
        else np.full((len(plan.quantiles), *values.shape[1:]), np.nan)
    )
    text, unit = output.attributes["long_name"], output.attributes["units"]
    statistics = {
        "quantile": ("quantile", quantiles, {"units": unit, "long_name": f"quantiles: {text}"}),
        "rank_correlation": (
            "parameter",
            rank_correlation(np.array(ranked, dtype=float)[good], flat[good]).reshape(shape),
            {"units": "1", "long_name": f"rank correlation with a parameter: {text}"},
        ),
    }
    if plan.settings.design == "saltelli":
        for key, array in zip(("first_order", "total_order"), sobol_indices(len(plan.parameters), flat), strict=True):
            attributes = {"units": "1", "long_name": f"Sobol' index, {key.replace('_', ' ')}: {text}"}
            statistics[key] = ("parameter", array.reshape(shape), attributes)
    return statistics


def _attributes(plan: SweepPlan, outcomes: list[RunOutcome]) -> dict[str, object]:
    failed = sum(bool(o.failure) for o in outcomes)
    return {
        **results.scene_record(plan.scene, "complete" if not failed else f"{failed} of {len(outcomes)} runs failed"),
        "title": plan.title,
        "sweep": plan.name,
        "set": json.dumps(plan.overrides),
        "design": json.dumps(asdict(plan.settings)),
        "parameters": json.dumps({p.name: p.values or {p.law: dict(p.arguments)} for p in plan.parameters}),
    }
