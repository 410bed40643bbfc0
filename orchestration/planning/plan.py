"""A plan: voltages for a path, checked by a run of the full models, and the scene that repeats it."""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..api import Overrides, Source, read
from ..cosim.signals import Steps
from ..errors import FmuWarning, SceneError
from ..files import atomic_write
from ..fmi.archive import Archive
from ..fmi.vectors import split_index
from ..results import ResultTable
from ..scene import Scene, changed
from ..scene.manipulator import DISPLACEMENT, ROD, TEMPERATURE, THERMAL, VOLTAGE
from ..scene.toml_writer import settings_of, toml_text
from ..simulation import run_table
from .heat import HOTTEST, HeatModel
from .limits import PlanLimits
from .problem import PathProblem, Solution
from .rod import StaticRod
from .target import Target

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Plan", "plan"]

MAX_ROUNDS = 4  # runs of the full models, each followed by a plan that takes their deviation along
GAIN = 0.9  # least decrease of the error, as a ratio, for which another round is made
NEGLIGIBLE = 1e-4  # deviation of the full models, as a share of the path's size, that needs no further plan
OUT_OF_REACH = 0.1  # share of the path's size from which on an error says that the path cannot be followed
AT_LIMIT = 1e-3  # share of the voltage within which it is at a limit
NEAR_LIMIT = 0.1  # [K] within which a temperature is at its limit
EXCESS = 0.01  # [K] by which the full models may pass a limit of temperature: rounding of the plan
STEPS_PER_KNOT = 4  # macro steps of the check, at least: errors between knots count too
MAX_SPANS = 4  # spans of time that a text names


@dataclass(frozen=True)
class Plan:
    """Voltages for a path, and what the full models do with them.

    Attributes
    ----------
    scene : Scene
        The plan as a scene; the voltages are constant between knots.
    target : Target
    limits : PlanLimits
    times : ndarray, shape (K + 1,)
        Knots [s].
    voltages : ndarray, shape (K, N)
        From knot to knot [V].
    table : ResultTable
        Run of the scene with the full models.
    result : xarray.Dataset
        The same, made when it is first asked for.
    error : ndarray, shape (n,)
        Distance from the path, over the outputs, at the times of the result from the first of the path on.
    rms, largest : float
        Of the error, over time.
    iterations : int
        Of the optimisation, all rounds together.
    rounds : int
        Runs of the full models.
    converged : bool
    active : tuple of str
        Limits that act, and when.
    """

    scene: Scene
    target: Target
    limits: PlanLimits
    times: np.ndarray
    voltages: np.ndarray
    table: ResultTable
    error: np.ndarray
    rms: float
    largest: float
    iterations: int
    rounds: int
    converged: bool
    active: tuple[str, ...]

    @property
    def reached(self) -> bool:
        """Whether the path is followed but for a share of its size."""
        return self.largest <= OUT_OF_REACH * self.target.size

    @cached_property
    def result(self) -> xr.Dataset:
        """Run of the scene with the full models."""
        return self.table.to_xarray()

    def write(self, folder: Path, name: str) -> list[Path]:
        """Write the scene NAME.toml with its table NAME.voltages.csv; return the files."""
        thermal = self.scene.model(THERMAL)
        assert thermal is not None
        elements = thermal.archive.vectors[VOLTAGE]
        table = io.StringIO()
        rows = csv.writer(table, lineterminator="\n")
        rows.writerow(["time [s]", *(f"{element} [V]" for element in elements)])
        last = np.vstack([self.voltages, self.voltages[-1:]])
        rows.writerows(
            [repr(float(t)), *(repr(float(v)) for v in row)] for t, row in zip(self.times, last, strict=True)
        )
        files = [folder / f"{name}.voltages.csv", folder / f"{name}.toml"]
        texts = [table.getvalue(), self._scene_text(files[0].name, thermal.name, elements)]
        for path, text in zip(files, texts, strict=True):
            with atomic_write(path) as draft:
                draft.write_text(text, encoding="utf-8")
        return files

    def _scene_text(self, table: str, thermal: str, elements: tuple[str, ...]) -> str:
        """Return the scene that this one was planned for, with the voltages of a table, as TOML."""
        own = settings_of(self.scene)
        own |= {"title": f"Plan: {self.scene.title}", "stop_time": float(self.times[-1])}
        member = {k: v for k, v in own.get(thermal, {}).items() if not _is_part(k, VOLTAGE)}
        member[VOLTAGE] = [{"table": {"file": table, "column": e, "interpolation": "held"}} for e in elements]
        return toml_text(own | {thermal: member})


def plan(
    scene: Source,
    target: Target | Callable[[Scene], Target],
    limits: PlanLimits | None = None,
    distance: float = 0.5,
    overrides: Overrides = (),
) -> Plan:
    """Find voltages with which a manipulator follows a path.

    Parameters
    ----------
    scene, overrides
        The manipulator, as read() takes it, with its loads; its voltages and stop time are not used.
    target : Target, or callable that returns it for the scene
    limits : PlanLimits, optional
    distance : float
        Of the knots between which voltages are constant [s].

    Returns
    -------
    Plan
        The best approximation where the path cannot be followed.

    Raises
    ------
    SceneError
        The limits contradict each other, the scene is no manipulator, or PIQP is missing.
    SubsystemError, CouplingError
        The full models fail.
    """
    limits = limits or PlanLimits()
    described = read(scene, overrides)
    wanted = target(described) if callable(target) else target
    if not 0.0 < distance <= wanted.times[-1]:
        raise SceneError(
            f"distance of the knots (--step) = {distance:g} s: give a length of up to {wanted.times[-1]:g} s, the end "
            "of the path"
        )
    if described.start_time != 0.0:
        raise SceneError(f"{described.name} starts at {described.start_time:g} s, plans at 0 s; set start_time = 0")
    count = max(1, round(wanted.times[-1] / distance))
    distance = float(wanted.times[-1] / count)
    times = distance * np.arange(1, count + 1)
    weights = (times >= wanted.times[0] - 1e-9 * distance).astype(float)
    thermal = described.model(THERMAL)
    with HeatModel(described) as heat, StaticRod(described, (*wanted.outputs, *_displacements(described))) as rod:
        assert thermal is not None
        problem = PathProblem(heat, rod, limits, distance, wanted.at(times), weights, wanted.scale)
        best: Plan | None = None
        powers, iterations = None, 0
        for round_ in range(1, MAX_ROUNDS + 1):
            solution = problem.solve(powers)
            powers, iterations = solution.powers, iterations + solution.iterations
            made = _checked(described, wanted, limits, times, solution, rod.member)
            made = replace(made, iterations=iterations, rounds=round_)
            deviation = _deviation(problem, solution, made, thermal.name, rod.member)
            improves = best is None or _rank(made) < _rank(best)
            enough = best is not None and _keeps(best) and made.rms > GAIN * best.rms
            best = made if improves else best
            if enough or (deviation < NEGLIGIBLE and _keeps(made)):
                break
        assert best is not None
        return replace(best, iterations=iterations)


def _is_part(key: str, vector: str) -> bool:
    """Tell whether a key of a scene is a vector or one of its elements."""
    return key == vector or key.startswith(f"{vector}[")


def _displacements(scene: Scene) -> tuple[str, ...]:
    rod = scene.model(ROD)
    return rod.archive.vectors[DISPLACEMENT] if rod is not None else ()


def _checked(scene: Scene, target: Target, limits: PlanLimits, times: np.ndarray, solution: Solution, rod: str) -> Plan:
    """Run a solution with the full models."""
    thermal = scene.model(THERMAL)
    assert thermal is not None
    knots = np.insert(times, 0, 0.0)
    signals = [Steps(tuple(knots[:-1]), tuple(column)) for column in solution.voltages.T]
    values = {f"{thermal.name}.{VOLTAGE}": signals, "stop_time": float(times[-1])}
    step = min(scene.coupling.macro_step, float(times[0]) / STEPS_PER_KNOT)
    values["coupling.macro_step"] = step
    open_already = {m.archive.path: m.archive for m in scene.members}
    planned = changed(scene, values, lambda path: open_already.get(path) or Archive(path), origin="plan")
    planned = replace(planned, title=scene.title, layers=scene.layers)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FmuWarning)  # of rounds that are not the last; the result has them all
        result = run_table(planned)
    when = result["time"].to_numpy()
    inside = when >= target.times[0] - 1e-9
    values = _outputs(result, rod, target.outputs)[inside]
    error = np.linalg.norm(values - target.at(when[inside]), axis=1)
    return Plan(
        scene=planned,
        target=target,
        limits=limits,
        times=knots,
        voltages=solution.voltages,
        table=result,
        error=error,
        rms=float(np.sqrt(np.trapezoid(error**2, when[inside]) / np.ptp(when[inside]))),
        largest=float(error.max()),
        iterations=0,
        rounds=0,
        converged=solution.converged,
        active=tuple(_active(result, solution, limits, knots, thermal.name)),
    )


def _deviation(problem: PathProblem, solution: Solution, made: Plan, thermal: str, rod: str) -> float:
    """Let the problem take along what the full models did otherwise; return how much that was, in sizes of the path."""
    at = np.searchsorted(made.table["time"].to_numpy(), made.times[1:] - 1e-9 * made.times[-1])
    outputs = _outputs(made.table, rod, made.target.outputs)[at]
    change = outputs - (solution.outputs + problem.correction)
    problem.correction += change
    temperatures = made.table[f"{thermal}.{TEMPERATURE}"].to_numpy()[at]
    problem.warming += temperatures - solution.temperatures
    return float(np.abs(change[problem.weights > 0.0]).max() / problem.scale)


def _outputs(result: ResultTable, member: str, names: tuple[str, ...]) -> np.ndarray:
    """Return the outputs (n, p) of a member over time."""
    columns = []
    for name in names:
        base, index = split_index(name)
        array = result[f"{member}.{base}"].to_numpy()
        for k in index:
            array = array[:, k - 1]
        columns.append(array)
    return np.stack(columns, axis=1)


def _rank(made: Plan) -> tuple[bool, float]:
    """Return what makes a plan better than another: it keeps the limits, and its error is smaller."""
    return not _keeps(made), made.rms


def _keeps(made: Plan) -> bool:
    """Tell whether the run keeps the limits of temperature, but for a share of the rise."""
    thermal = made.scene.model(THERMAL)
    assert thermal is not None
    room = EXCESS
    mean = float(made.table[f"{thermal.name}.{TEMPERATURE}"].to_numpy().max())
    hottest = float(made.table[f"{thermal.name}.{HOTTEST}"].to_numpy().max())
    return mean <= made.limits.temperature + room and hottest <= made.limits.hottest + room


def _active(result: ResultTable, solution: Solution, limits: PlanLimits, knots: np.ndarray, thermal: str) -> list[str]:
    """Return the limits that act, with the spans of time in which they do."""
    texts = []
    V = solution.voltages
    for i in range(V.shape[1]):
        texts += _spans(f"V[{i + 1}] at {limits.voltage:g} V", V[:, i] >= limits.voltage * (1.0 - AT_LIMIT), knots)
        texts += _spans(f"V[{i + 1}] at 0 V", V[:, i] <= limits.voltage * AT_LIMIT, knots)
    most = limits.voltage_rate * (knots[1] - knots[0])
    for i, change in enumerate(np.abs(np.diff(np.vstack([np.zeros(V.shape[1]), V]), axis=0)).T, 1):
        texts += _spans(f"V[{i}] changes by {limits.voltage_rate:g} V/s", change >= most * (1.0 - AT_LIMIT), knots)
    when = result["time"].to_numpy()
    for k, column in enumerate(result[f"{thermal}.{TEMPERATURE}"].to_numpy().T, 1):
        name = f"T[{k}] at {limits.temperature - 273.15:.4g} degC"
        texts += _spans(name, column[:-1] >= limits.temperature - NEAR_LIMIT, when)
    hottest = result[f"{thermal}.{HOTTEST}"].to_numpy()
    name = f"hottest point at {limits.hottest - 273.15:.4g} degC"
    texts += _spans(name, hottest[:-1] >= limits.hottest - NEAR_LIMIT, when)
    return texts


def _spans(name: str, acts: np.ndarray, knots: np.ndarray) -> list[str]:
    """Return 'name from a to b s, c to d s' for the intervals in which it acts; nothing where it never does."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], acts, [False]]).astype(int)))
    spans = [f"{knots[a]:.4g} to {knots[b]:.4g} s" for a, b in zip(edges[::2], edges[1::2], strict=True)]
    if not spans:
        return []
    shown = spans[:MAX_SPANS] + ([f"and {len(spans) - MAX_SPANS} more"] if len(spans) > MAX_SPANS else [])
    return [f"{name}: {', '.join(shown)}"]
