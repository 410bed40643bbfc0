"""Many runs of one scene with a table of parameters: by the engine where it can run them, else one after the other.

The engine takes parameters that change nothing but themselves: the scene read with a value is the same scene with that
value in it. All others, such as a closure that changes the wiring, are read and run by the master, run by run. Both
give the same numbers.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import monotonic
from typing import Any, NamedTuple

import numpy as np

from .. import scene as scenes
from .. import simulation
from ..engine import BatchResult
from ..engine.batch import count_runs, run_plan, summary_of_warnings
from ..engine.binding import library
from ..engine.plan import EnginePlan, communication_points, expanded
from ..errors import CosimError, FmuWarning, SceneError
from ..fmi.log import Warned
from ..results import ResultTable
from ..scene import Scene

__all__ = ["EngineRun", "EngineRuns", "run_many", "warnings_of"]

FIRST_BLOCK, MOST_BLOCK = 16, 4096  # runs of one call of the engine, at first and at most
SHORTEST, LONGEST = 0.25, 1.0  # [s] of one call, outside of which the next has twice or half as many runs
Value = float | int | bool | str


class EngineRun(NamedTuple):
    """A run that the engine has done.

    number: row of the table; rows: (steps + 1, outputs), None where the master is to do it, since a value is out of
    range or a step fails; warning: what FMUs warned of, empty where they did not.
    """

    number: int
    rows: np.ndarray | None
    warning: str


@dataclass(frozen=True, eq=False)
class EngineRuns:
    """Runs of a scene by the engine.

    plan: of the scene; elements: for each column of the table the limits of its variables; threads: default: one for
    each core.
    """

    plan: EnginePlan
    limits: np.ndarray  # (2, columns)
    threads: int | None = None

    @classmethod
    def of(
        cls, scene: Scene, columns: Mapping[str, Sequence[Any]], outputs: Sequence[str], threads: int | None = None
    ) -> EngineRuns | None:
        """Return what runs a table of parameters, name -> values (runs,), or None where only the master can.

        So it is where the engine is not built.
        """
        if not all(_is_plain(scene, name, values) for name, values in columns.items()):
            return None
        try:
            library()
            plan = EnginePlan.of(scene, list(columns), [], outputs)
        except CosimError:  # the master says why, where that stops it too
            return None
        if not plan.rounds_as_master:
            return None
        limits = [_limits(scene, name) for name in columns]
        return cls(plan, np.array(limits, dtype=float).reshape(-1, 2).T, threads)

    def blocks(self, table: np.ndarray) -> Iterator[list[EngineRun]]:
        """Run a table (runs, columns); yield its runs in blocks."""
        with np.errstate(invalid="ignore"):
            good = ((table >= self.limits[0]) & (table <= self.limits[1])).all(axis=1)
        first, size = 0, FIRST_BLOCK
        while first < len(table):
            numbers = range(first, min(first + size, len(table)))
            chosen = [k for k in numbers if good[k]]
            begin = monotonic()
            ran = zip(*run_plan(self.plan, table[chosen], threads=self.threads), strict=True) if chosen else ()
            spent, first = monotonic() - begin, first + size
            block = {k: EngineRun(k, None, "") for k in numbers}
            for k, (row, failure, warning) in zip(chosen, ran, strict=True):
                if not failure:
                    block[k] = EngineRun(k, row, warning)
            yield list(block.values())
            if spent < SHORTEST:
                size = min(2 * size, MOST_BLOCK)
            elif spent > LONGEST:
                size = max(size // 2, 1)


def run_many(
    scene: Scene,
    table: Mapping[str, Sequence[Value] | np.ndarray],
    outputs: Sequence[str] = ("rod.tip.p",),
    threads: int | None = None,
) -> BatchResult:
    """Run a scene once for each row of a table.

    Parameters
    ----------
    scene
        What is run; macro steps of one length.
    table
        Key of a scene -> values (runs,), as overrides take them.
    outputs
        Names of numeric inputs and outputs, vectors whole.
    threads
        Number of threads of the engine; default: one for each core.

    Returns
    -------
    BatchResult
        The numbers that each run alone gives. A run that fails has nan and its message in `failures`. That FMUs warn
        comes as one FmuWarning too.

    Raises
    ------
    SceneError
        A key or an output is not known, columns differ in length, or runs end at different times.
    """
    runs = count_runs(scene, table.values())
    columns = {name: np.asarray(values).tolist() for name, values in table.items()}
    engine = EngineRuns.of(scene, columns, outputs, threads)
    names = {name: expanded(scene, name, ("input", "output")) for name in outputs}
    if engine is not None:
        order = engine.plan.outputs
        numbers = np.array(list(columns.values()), dtype=float).T
        by_run = [run for block in engine.blocks(numbers) for run in block]
    else:
        edges = np.cumsum([0, *(len(elements) for elements in names.values())]).tolist()
        order = {name: slice(edges[k], edges[k + 1]) for k, name in enumerate(names)}
        by_run = [EngineRun(k, None, "") for k in range(runs)]
    failures, warned = [""] * runs, [run.warning for run in by_run]
    times = communication_points(scene) if scene.coupling.control == "fixed" else None
    rows = {run.number: run.rows for run in by_run if run.rows is not None}
    for k in (run.number for run in by_run if run.rows is None):
        try:
            changed = scenes.changed(scene, {name: values[k] for name, values in columns.items()})
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FmuWarning)  # all of them are said at the end
                result = simulation.run_table(changed)
            warned[k] = warnings_of(result)
        except CosimError as error:
            failures[k] = str(error)
            continue
        ran = result["time"].to_numpy()
        if times is None or not (rows or engine or np.isin(times, ran).all()):
            times = ran  # the first run says where the others are kept
        kept = np.flatnonzero(np.isin(ran, times))  # a step that failed was halved: there are others between
        if not np.array_equal(times, ran[kept]):
            raise SceneError(f"{scene.name}: run {k} has other communication points; run it alone (tca.run)")
        parts = [result[name].to_numpy().reshape(ran.size, -1)[kept] for name in order]
        rows[k] = np.concatenate(parts, axis=1).astype(float)
    if times is None or not (rows or engine):
        raise SceneError(f"{scene.name}: every run failed, the first with: {failures[0]}")
    width = sum(columns.stop - columns.start for columns in order.values())
    values = np.full((runs, times.size, width), np.nan)
    for k, row in rows.items():
        values[k] = row
    if text := summary_of_warnings(warned):
        warnings.warn(text, FmuWarning, stacklevel=2)
    return BatchResult(times, values[:, 0], values[:, 1:], tuple(failures), tuple(warned), order)


def warnings_of(result: ResultTable) -> str:
    """Return what FMUs warned of in a run, as one text; empty where they did not."""
    return "; ".join(str(Warned(**one)) for one in json.loads(result.attrs["warnings"]))


def _limits(scene: Scene, name: str) -> tuple[float, float]:
    """Range in which every variable of a parameter allows a value."""
    variables = []
    for one in expanded(scene, name, ("parameter",)):
        member = next(m for m in scene.members if one.startswith(f"{m.name}."))
        variables.append(member.archive.variables[one[len(member.name) + 1 :]])
    return max(v.least for v in variables), min(v.most for v in variables)


def _is_plain(scene: Scene, name: str, values: Sequence[Any]) -> bool:
    """Whether a key is a Real parameter whose values change nothing else in the scene."""
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values) or not len(values):
        return False
    try:
        elements, (least, most) = expanded(scene, name, ("parameter",)), _limits(scene, name)
        allowed = [value for value in values if least <= value <= most]  # the master refuses the others
        if not allowed:
            return False
        for value in (min(allowed), max(allowed)):
            if not _same_but_for(scenes.changed(scene, {name: value}), scene, elements, float(value)):
                return False
    except CosimError:
        return False
    return True


def _same_but_for(changed: Scene, scene: Scene, elements: Sequence[str], value: float) -> bool:
    """Whether two scenes are the same but for these parameters, which have that value in the first."""
    expected = []
    for member in scene.members:
        mine = {one[len(member.name) + 1 :]: value for one in elements if one.startswith(f"{member.name}.")}
        parameters = member.with_values(mine).parameters
        expected.append((member.name, member.archive.digest, dict(parameters), member.signals, member.frozen))
    actual = [(m.name, m.archive.digest, dict(m.parameters), m.signals, m.frozen) for m in changed.members]
    alike = replace(changed, members=scene.members, title=scene.title, sources=scene.sources, overrides=scene.overrides)
    return actual == expected and alike == scene
