"""A sweep as data: TOML in, checked against the scene's FMUs."""

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
from .parameter import Axis

__all__ = ["KEYS", "Plan", "Settings", "read"]

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
_MOST = 10_000_000  # numbers kept per sweep and output element, as a guard against a slip


@dataclass(frozen=True)
class Settings:
    """How points are chosen and what is kept of a run."""

    design: str = setting(
        "sobol",
        "sobol: scrambled sequence; latin: hypercube; random; grid: all combinations; saltelli: for Sobol' indices",
        choices=design.DESIGNS,
    )
    runs: int = setting(0, "number of runs; a grid knows its own", least=0, most=1_000_000)
    seed: int = setting(1, "of the design", least=0, most=2**31 - 1)
    interval: float = setting(0.0, "between the times kept, linear between macro steps; 0: the macro step", "s")


@dataclass(frozen=True)
class Plan:
    """What is to be run. points: (runs, axes) as --set texts."""

    name: str
    title: str
    source: str  # scene name or file
    overrides: tuple[str, ...]
    scene: Scene
    settings: Settings
    axes: tuple[Axis, ...]
    values: tuple[tuple[Any, ...], ...]  # per run, one per axis
    outputs: tuple[str, ...]
    quantiles: tuple[float, ...]
    times: np.ndarray  # (n,) [s]

    def points(self) -> list[tuple[str, ...]]:
        """Per run, what is set."""
        return [
            tuple(text for a, v in zip(self.axes, row, strict=True) for text in a.settings(v)) for row in self.values
        ]

    def columns(self) -> dict[str, tuple[tuple[str, ...], tuple[int, ...], dict[str, str]]]:
        """Per output: dimensions and shape beyond time, attributes."""
        found = _columns(self.scene)
        return {name: found[name] for name in self.outputs}

    def identity(self) -> dict[str, str]:
        """Everything that makes a run what it is; more runs of the same sweep are still the same."""
        about = results.scene_record(self.scene, "")
        chosen = {key: value for key, value in asdict(self.settings).items() if key != "runs"}
        return {
            **{key: str(about[key]) for key in ("stop_time_s", "coupling", "connections", "members", "versions")},
            "settings": json.dumps(chosen),
            "parameters": json.dumps([[a.name, a.values, a.law, a.arguments, a.levels] for a in self.axes]),
            "outputs": json.dumps(self.outputs),
            "times": json.dumps(list(self.times)),
            **{m.name: m.archive.digest for m in self.scene.members},
        }


def read(source: str | Path, runs: int | None = None, overrides: Sequence[str] = ()) -> Plan:
    """The sweep of that name or file. runs: in place of the file's; overrides: after those of the file. Raises
    CosimError, which names file, key, value and remedy."""
    path = scene.find(source, "sweeps", "sweep")
    layer = scene.load(path)
    top = dict(layer.raw)
    known = {key: top.pop(key) for key in KEYS if key in top}
    chosen = settings(Settings, [(layer, top)])
    chosen = chosen if runs is None else replace(chosen, runs=runs)
    for key in ("scene", "outputs", "parameters"):
        if not known.get(key):
            layer.refuse(key, None, f"missing; add {KEYS[key]}")
    texts = {key: _texts(layer, key, known.get(key, [])) for key in ("set", "outputs")}
    if not isinstance(known["scene"], str):
        layer.refuse("scene", known["scene"], f"wants the {KEYS['scene']}")
    beside = path.parent / known["scene"]
    where = str(beside) if beside.is_file() else known["scene"]
    base = scene.read(where, held := (*texts["set"], *overrides))
    if base.accuracy.level == "auto":
        remedy = "add to set what `tca-cosim select` finds, and 'fidelity.level=given'"
        layer.refuse("scene", known["scene"], f"fidelity.level = 'auto' would choose anew in every run; {remedy}")
    if not isinstance(known["parameters"], Mapping):
        layer.refuse("parameters", known["parameters"], f"wants a {KEYS['parameters']}")
    axes = tuple(parameter.read(layer, base, name, raw) for name, raw in known["parameters"].items())
    chosen = _counted(layer, chosen, axes)
    cube = design.points(chosen.design, chosen.runs, chosen.seed, [a.cells for a in axes])
    return Plan(
        name=path.stem,
        title=str(known.get("title", path.stem)),
        source=where,
        overrides=held,
        scene=base,
        settings=chosen,
        axes=axes,
        values=tuple(tuple(a.at(float(u)) for a, u in zip(axes, row, strict=True)) for row in cube),
        outputs=_outputs(layer, base, texts["outputs"]),
        quantiles=_quantiles(layer, known.get("quantiles", [0.05, 0.25, 0.5, 0.75, 0.95])),
        times=_times(layer, base, chosen),
    )


def _texts(layer: Layer, key: str, raw: Any) -> tuple[str, ...]:
    if not isinstance(raw, list) or not all(isinstance(text, str) for text in raw):
        layer.refuse(key, raw, f"wants a {KEYS[key]}")
    return tuple(raw)


def _counted(layer: Layer, chosen: Settings, axes: Sequence[Axis]) -> Settings:
    """With the number of runs that the design has."""
    if chosen.design != "grid":
        if levelled := [a.name for a in axes if a.levels]:
            layer.refuse("parameters", levelled[0], "levels are of design = 'grid'; remove them or take that design")
        if not chosen.runs:
            layer.refuse("runs", None, "missing; add for example runs = 256")
        if chosen.design == "saltelli":
            design.saltelli_base(chosen.runs, len(axes))
        return chosen
    if flat := [a.name for a in axes if not a.cells]:
        layer.refuse("parameters", flat[0], "in a grid a distribution wants levels, such as levels = 5")
    cells = math.prod(a.cells for a in axes)
    if chosen.runs not in (0, cells):
        layer.refuse("runs", chosen.runs, f"the grid has {cells} points; leave runs out, or change lists and levels")
    return replace(chosen, runs=cells)


def _outputs(layer: Layer, base: Scene, names: Sequence[str]) -> tuple[str, ...]:
    known = _columns(base)
    for name in names:
        if name not in known:
            layer.refuse("outputs", name, f"no input or output of the scene; {similar(name, list(known))}")
    return tuple(dict.fromkeys(names))


def _columns(base: Scene) -> dict[str, tuple[tuple[str, ...], tuple[int, ...], dict[str, str]]]:
    found = {}
    for member in base.members:
        variables = recorded_variables(member)
        for name, (dims, empty, about) in results.arrays(member.name, variables, np.empty((0, len(variables)))).items():
            found[name] = dims[1:] if len(dims) > 1 else (), empty.shape[1:], about
    return found


def _quantiles(layer: Layer, raw: Any) -> tuple[float, ...]:
    numbers = raw if isinstance(raw, list) and raw else [None]
    if not all(isinstance(q, (int, float)) and not isinstance(q, bool) and 0.0 <= q <= 1.0 for q in numbers):
        layer.refuse("quantiles", raw, f"wants a {KEYS['quantiles']}")
    return tuple(sorted(float(q) for q in set(numbers)))


def _times(layer: Layer, base: Scene, chosen: Settings) -> np.ndarray:
    interval = chosen.interval or base.coupling.macro_step
    count = max(1, round(base.stop_time / interval))
    if count * chosen.runs > _MOST:
        layer.refuse("interval", interval, f"{count} times in {chosen.runs} runs; a longer interval keeps less")
    if not math.isclose(count * interval, base.stop_time, rel_tol=1e-9):
        raise CosimError(
            f"interval = {interval:g} s does not divide the stop time of {base.stop_time:g} s; take one that does"
        )
    return np.linspace(0.0, base.stop_time, count + 1)
