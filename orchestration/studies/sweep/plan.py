"""The plan of a sweep: read from TOML and checked against the scene's FMUs."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ... import results, scene
from ...errors import CosimError
from ...fmi.archive import similar
from ...scene import Scene
from ...scene.schema import setting, settings
from ...scene.validation import Layer
from ...simulation import recorded_variables
from . import design, parameter
from .parameter import Parameter

__all__ = ["KEYS", "OutputColumns", "SweepPlan", "SweepSettings", "read_plan"]

KEYS = {
    "title": "one line of text",
    "scene": "name of a scene, or a .toml or .ssp file (also from the folder of the sweep)",
    "set": "list of 'key=value' that hold in all runs",
    "outputs": "list of vectors or variables to keep, such as 'rod.tip.p'",
    "quantiles": "list of shares between 0 and 1; default: 0.05, 0.25, 0.5, 0.75, 0.95",
    "parameters": "table of 'fmu.parameter' (several of one value: with commas) = a list of values, or a distribution "
    "of scipy.stats, { name = { arguments } }, whose loc and scale have the parameter's unit; levels = n: its "
    "values in a grid",
}
_MOST = 10_000_000  # largest number of values kept per output element: a guard against a slip in interval or runs


@dataclass(frozen=True)
class SweepSettings:
    """Settings of a sweep: its design and the times that are kept of each run."""

    design: str = setting(
        "sobol",
        "sobol: scrambled sequence; latin: hypercube; random; grid: all combinations; saltelli: for Sobol' indices",
        choices=design.DESIGNS,
    )
    runs: int = setting(0, "number of runs; a grid knows its own", least=0, most=1_000_000)
    seed: int = setting(1, "of the design", least=0, most=2**31 - 1)
    interval: float = setting(0.0, "between the times kept, linear between macro steps; 0: the macro step", "s")


@dataclass(frozen=True)
class OutputColumns:
    """Shape of one output in the rows of a run, beyond its time dimension."""

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    attributes: dict[str, str]

    @property
    def count(self) -> int:
        """Number of scalar columns."""
        return math.prod(self.shape)


@dataclass(frozen=True)
class SweepPlan:
    """Everything that a sweep runs and keeps."""

    name: str
    title: str
    source: str  # name or file of the scene
    overrides: tuple[str, ...]  # of every run
    scene: Scene
    settings: SweepSettings
    parameters: tuple[Parameter, ...]
    values: tuple[tuple[Any, ...], ...]  # (runs, parameters)
    outputs: tuple[str, ...]
    quantiles: tuple[float, ...]
    times: np.ndarray  # (n,) [s] that are kept

    def run_overrides(self) -> list[tuple[str, ...]]:
        """Overrides of each run beyond those of every run."""
        return [
            tuple(text for p, v in zip(self.parameters, row, strict=True) for text in p.settings(v))
            for row in self.values
        ]

    def columns(self) -> dict[str, OutputColumns]:
        """Columns of each output kept, in the order of a run's rows."""
        columns = _columns(self.scene)
        return {name: columns[name] for name in self.outputs}

    def identity(self) -> dict[str, str]:
        """Everything that decides the result of a run; the number of runs does not."""
        record = results.scene_record(self.scene, "")
        chosen = {key: value for key, value in asdict(self.settings).items() if key != "runs"}
        return {
            **{key: str(record[key]) for key in ("stop_time_s", "coupling", "connections", "members", "versions")},
            "settings": json.dumps(chosen),
            "parameters": json.dumps([[p.name, p.values, p.law, p.arguments, p.levels] for p in self.parameters]),
            "outputs": json.dumps(self.outputs),
            "times": json.dumps(list(self.times)),
            **{m.name: m.archive.digest for m in self.scene.members},
        }


def read_plan(source: str | Path, runs: int | None = None, overrides: Sequence[str] = ()) -> SweepPlan:
    """Read the plan of a sweep.

    Parameters
    ----------
    source : str or Path
        Name of a sweep of the package, or a .toml file.
    runs : int, optional
        Number of runs in place of that of the file.
    overrides : sequence of str
        'key=value' that hold in all runs, after (and so instead of) those of the file.

    Returns
    -------
    SweepPlan

    Raises
    ------
    CosimError
        Names file, key, value and remedy.
    """
    path = scene.find(source, "sweeps", "sweep")
    layer = scene.load(path)
    top = dict(layer.raw)
    entries = {key: top.pop(key) for key in KEYS if key in top}
    chosen = settings(SweepSettings, [(layer, top)])
    chosen = chosen if runs is None else replace(chosen, runs=runs)
    for key in ("scene", "outputs", "parameters"):
        if not entries.get(key):
            layer.refuse(key, None, f"missing; add {KEYS[key]}")
    texts = {key: _texts(layer, key, entries.get(key, [])) for key in ("set", "outputs")}
    if not isinstance(entries["scene"], str):
        layer.refuse("scene", entries["scene"], f"wants the {KEYS['scene']}")
    beside = path.parent / entries["scene"]
    where = str(beside) if beside.is_file() else entries["scene"]
    base = scene.read(where, common := (*texts["set"], *overrides))
    if base.accuracy.level == "auto":
        remedy = "add to set what `tca-cosim select` finds, and 'fidelity.level=given'"
        layer.refuse("scene", entries["scene"], f"fidelity.level = 'auto' would choose anew in every run; {remedy}")
    if not isinstance(entries["parameters"], Mapping):
        layer.refuse("parameters", entries["parameters"], f"wants a {KEYS['parameters']}")
    parameters = tuple(parameter.read_parameter(layer, base, name, raw) for name, raw in entries["parameters"].items())
    chosen = _counted(layer, chosen, parameters)
    samples = design.samples(chosen.design, chosen.runs, chosen.seed, [p.cells for p in parameters])
    return SweepPlan(
        name=path.stem,
        title=str(entries.get("title", path.stem)),
        source=where,
        overrides=common,
        scene=base,
        settings=chosen,
        parameters=parameters,
        values=tuple(tuple(p.value_at(float(u)) for p, u in zip(parameters, row, strict=True)) for row in samples),
        outputs=_outputs(layer, base, texts["outputs"]),
        quantiles=_quantiles(layer, entries.get("quantiles", [0.05, 0.25, 0.5, 0.75, 0.95])),
        times=_times(layer, base, chosen),
    )


def _texts(layer: Layer, key: str, raw: Any) -> tuple[str, ...]:
    if not isinstance(raw, list) or not all(isinstance(text, str) for text in raw):
        layer.refuse(key, raw, f"wants a {KEYS[key]}")
    return tuple(raw)


def _counted(layer: Layer, chosen: SweepSettings, parameters: Sequence[Parameter]) -> SweepSettings:
    """The settings with the number of runs that the design has."""
    if chosen.design != "grid":
        if levelled := [p.name for p in parameters if p.levels]:
            layer.refuse("parameters", levelled[0], "levels are of design = 'grid'; remove them or take that design")
        if not chosen.runs:
            layer.refuse("runs", None, "missing; add for example runs = 256")
        if chosen.design == "saltelli":
            design.saltelli_base(chosen.runs, len(parameters))
        return chosen
    if flat := [p.name for p in parameters if not p.cells]:
        layer.refuse("parameters", flat[0], "in a grid a distribution wants levels, such as levels = 5")
    cells = math.prod(p.cells for p in parameters)
    if chosen.runs not in (0, cells):
        layer.refuse("runs", chosen.runs, f"the grid has {cells} points; leave runs out, or change lists and levels")
    return replace(chosen, runs=cells)


def _outputs(layer: Layer, base: Scene, names: Sequence[str]) -> tuple[str, ...]:
    known = _columns(base)
    for name in names:
        if name not in known:
            layer.refuse("outputs", name, f"no input or output of the scene; {similar(name, list(known))}")
    return tuple(dict.fromkeys(names))


def _columns(base: Scene) -> dict[str, OutputColumns]:
    columns = {}
    for member in base.members:
        variables = recorded_variables(member)
        for name, array in results.arrays(member.name, variables, np.empty((0, len(variables)))).items():
            columns[name] = OutputColumns(array.dims[1:], array.shape[1:], array.attrs)
    return columns


def _quantiles(layer: Layer, raw: Any) -> tuple[float, ...]:
    numbers = raw if isinstance(raw, list) and raw else [None]
    if not all(isinstance(q, (int, float)) and not isinstance(q, bool) and 0.0 <= q <= 1.0 for q in numbers):
        layer.refuse("quantiles", raw, f"wants a {KEYS['quantiles']}")
    return tuple(sorted(float(q) for q in set(numbers)))


def _times(layer: Layer, base: Scene, chosen: SweepSettings) -> np.ndarray:
    interval = chosen.interval or base.coupling.macro_step
    count = max(1, round(base.stop_time / interval))
    if count * chosen.runs > _MOST:
        layer.refuse("interval", interval, f"{count} times in {chosen.runs} runs; a longer interval keeps less")
    if not math.isclose(count * interval, base.stop_time, rel_tol=1e-9):
        raise CosimError(
            f"interval = {interval:g} s does not divide the stop time of {base.stop_time:g} s; take one that does"
        )
    return np.linspace(0.0, base.stop_time, count + 1)
