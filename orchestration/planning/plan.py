"""A plan: voltages for a path, checked by a run of the full models, and the scene that repeats it."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..api import Overrides, Source, read
from ..errors import SceneError
from ..files import atomic_write
from ..results import ResultTable
from ..scene import Scene
from ..scene.manipulator import DISPLACEMENT, VOLTAGE, is_element_of
from ..scene.toml_writer import settings_of, toml_text
from .full_models import FullModels, prefix_of
from .heat import HeatModel
from .limits import PlanLimits
from .manipulator import Manipulator, rod_of
from .problem import PathProblem, Solution
from .rod import StaticRod
from .target import Target

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Plan", "plan"]

MAX_UNKNOWNS = 2000  # voltages of a plan: the time grows with their cube, from half a minute at this number on
MAX_ROUNDS = 4  # runs of the full models, each followed by a plan that takes their deviation along
GAIN = 0.9  # least decrease of the error, as a ratio, for which another round is made
NEGLIGIBLE = 1e-4  # deviation of the full models, as a share of the path's size, that needs no further plan
OUT_OF_REACH = 0.1  # share of the path's size from which on an error says that the path cannot be followed


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
    seconds : ndarray, shape (n,)
        Times of the result from the first of the path on [s].
    differences : ndarray, shape (n, p)
        Outputs less the path, at these times.
    keeps_limits : bool
        Whether the run keeps the limits of temperature.
    hottest : float
        Highest temperature of the run [K].
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
    seconds: np.ndarray
    differences: np.ndarray
    keeps_limits: bool
    hottest: float
    iterations: int
    rounds: int
    converged: bool
    active: tuple[str, ...]

    @property
    def error(self) -> np.ndarray:
        """Distance (n,) from the path, over the outputs; where these have several units, in scales of the path."""
        several = len(self.target.columns) > 1
        return np.linalg.norm(self.differences / (self.target.scales if several else 1.0), axis=1)

    @property
    def rms(self) -> float:
        """Root mean square of the error over time."""
        return self._rms(self.error)

    @property
    def largest(self) -> float:
        """Largest error."""
        return float(self.error.max())

    @property
    def errors(self) -> dict[str, tuple[float, float]]:
        """Root mean square over time and largest distance from the path, over the outputs of each unit."""
        distances = self.target.distances(self.differences)
        return {unit: (self._rms(error), float(error.max())) for unit, error in distances.items()}

    @property
    def reached(self) -> bool:
        """Whether the path is followed but for a share of its size, in each unit."""
        sizes = self.target.sizes
        return all(largest <= OUT_OF_REACH * sizes[unit] for unit, (_, largest) in self.errors.items())

    def _rms(self, error: np.ndarray) -> float:
        if len(error) == 1:
            return float(error[0])
        return float(np.sqrt(np.trapezoid(error**2, self.seconds) / np.ptp(self.seconds)))

    @cached_property
    def result(self) -> xr.Dataset:
        """Run of the scene with the full models."""
        return self.table.to_xarray()

    def write(self, folder: Path, name: str) -> list[Path]:
        """Write the scene NAME.toml with its table NAME.voltages.csv; return the files."""
        sections = Manipulator.of(self.scene).sections
        columns = {m.name: [f"{prefix_of(sections, m)}{v}" for v in m.archive.vectors[VOLTAGE]] for m in sections}
        table = io.StringIO()
        rows = csv.writer(table, lineterminator="\n")
        rows.writerow(["time [s]", *(f"{column} [V]" for of_one in columns.values() for column in of_one)])
        last = np.vstack([self.voltages, self.voltages[-1:]])
        rows.writerows(
            [repr(float(t)), *(repr(float(v)) for v in row)] for t, row in zip(self.times, last, strict=True)
        )
        files = [folder / f"{name}.voltages.csv", folder / f"{name}.toml"]
        texts = [table.getvalue(), self._scene_text(files[0].name, columns)]
        for path, text in zip(files, texts, strict=True):
            with atomic_write(path) as draft:
                draft.write_text(text, encoding="utf-8")
        return files

    def _scene_text(self, table: str, columns: Mapping[str, Sequence[str]]) -> str:
        """Return the scene that this one was planned for, with the voltages of a table, as TOML."""
        own = settings_of(self.scene)
        own |= {"title": f"Plan: {self.scene.title}", "stop_time": float(self.times[-1])}
        for section, names in columns.items():
            kept = {k: v for k, v in own.get(section, {}).items() if not is_element_of(k, VOLTAGE)}
            own[section] = kept | {
                VOLTAGE: [{"table": {"file": table, "column": name, "interpolation": "held"}} for name in names]
            }
        return toml_text(own)


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
    tcas = sum(len(m.archive.vectors[VOLTAGE]) for m in Manipulator.of(described).sections)
    knots = float(wanted.times[-1]) / distance
    if knots * tcas > MAX_UNKNOWNS:
        least = 1.01 * wanted.times[-1] * tcas / MAX_UNKNOWNS  # 1.01: it is shown with three digits
        raise SceneError(
            f"distance of the knots (--step) = {distance:g} s: {knots:.4g} knots of {tcas} TCAs until "
            f"{wanted.times[-1]:g} s are too many; give {least:.3g} s or more, or a shorter path"
        )
    count = max(1, round(knots))
    distance = float(wanted.times[-1] / count)
    times = distance * np.arange(1, count + 1)
    weights = (times >= wanted.times[0] - 1e-9 * distance).astype(float)
    full, displacements = FullModels(described, wanted, limits), rod_of(described).archive.vectors[DISPLACEMENT]
    with HeatModel(described) as heat, StaticRod(described, (*wanted.outputs, *displacements)) as rod:
        _require_warmth(heat, rod, wanted)
        problem = PathProblem(heat, rod, limits, distance, wanted.at(times), weights, wanted.scales)
        best: Plan | None = None
        powers, iterations = None, 0
        for round_ in range(1, MAX_ROUNDS + 1):
            solution = problem.solve(powers)
            powers, iterations = solution.powers, iterations + solution.iterations
            planned, table = full.run(times, solution.voltages)
            deviation = _take_along(problem, solution, full.at(table, times))
            seconds, differences = full.differences(table)
            made = Plan(
                scene=planned,
                target=wanted,
                limits=limits,
                times=np.insert(times, 0, 0.0),
                voltages=solution.voltages,
                table=table,
                seconds=seconds,
                differences=differences,
                keeps_limits=full.keeps_limits(table),
                hottest=full.hottest(table),
                iterations=iterations,
                rounds=round_,
                converged=solution.converged,
                active=tuple(full.active_limits(table, np.insert(times, 0, 0.0), solution.voltages)),
            )
            improves = best is None or _rank(made) < _rank(best)
            enough = best is not None and best.keeps_limits and made.rms > GAIN * best.rms
            best = made if improves else best
            if enough or (deviation < NEGLIGIBLE and made.keeps_limits):
                break
        assert best is not None
        return replace(best, iterations=iterations)


def _require_warmth(heat: HeatModel, rod: StaticRod, target: Target) -> None:
    """Raise SceneError where heat does not change an output of the rod at rest, such as a speed."""
    tangents = rod.linear((heat.T_start + 1.0 + 0.3 * np.arange(len(heat.T_start)))[None])[1][0]
    for name, tangent in zip(target.outputs, tangents, strict=False):
        if not tangent.any():
            raise SceneError(
                f"path of {name!r}: heat does not change it while the rod is at rest; plan positions, directions or "
                "displacements, such as tip.p[1]"
            )


def _take_along(problem: PathProblem, solution: Solution, computed: tuple[np.ndarray, np.ndarray]) -> float:
    """Let the problem take along what the full models did otherwise; return how much that was, in sizes of the path.

    computed: their outputs (K, p) and temperatures (K, N) [K] at the knots.
    """
    outputs, temperatures = computed
    change = outputs - (solution.outputs + problem.correction)
    problem.correction += change
    problem.warming += temperatures - solution.temperatures
    return float((np.abs(change[problem.weights > 0.0]) / problem.scale).max())


def _rank(made: Plan) -> tuple[bool, float]:
    """Return what makes a plan better than another: it keeps the limits, and its error is smaller."""
    return not made.keeps_limits, made.rms
