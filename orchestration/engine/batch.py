"""Many runs of one scene in one call of the engine.

It has threads, one instance of every FMU in each, and no Python in the loop.
"""

from __future__ import annotations

import ctypes
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import FmuWarning, Interrupted, SceneError, SubsystemError
from ..scene import Scene
from .binding import library
from .plan import EnginePlan
from .watched_call import WatchedCall

__all__ = ["BatchResult", "cores", "count_runs", "run_batch", "run_plan", "summary_of_warnings"]

MAX_TEXT = 1000  # characters of the text of a failure, and of the warnings of a run


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True, eq=False)
class BatchResult:
    """Outputs of many runs.

    Attributes
    ----------
    times : ndarray, shape (steps + 1,)
        Start and ends of the macro steps [s].
    initial : ndarray, shape (runs, n_y)
        Outputs at the start.
    outputs : ndarray, shape (runs, steps, n_y)
        Outputs at the end of every macro step, in their own units; nan in runs that failed.
    failures, warnings : tuple of str, length runs
        Why a run failed, and what its FMUs warned of first; empty where it did not, or they did not.
    columns : dict of str to slice
        Name of an output -> its columns.
    """

    times: np.ndarray
    initial: np.ndarray
    outputs: np.ndarray
    failures: tuple[str, ...]
    warnings: tuple[str, ...]
    columns: Mapping[str, slice] = field(repr=False)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return one output (runs, steps, elements)."""
        values: np.ndarray = self.outputs[:, :, self.columns[name]]
        return values


def count_runs(scene: Scene, columns: Iterable[Sequence[Any] | np.ndarray]) -> int:
    """Return the number of runs of columns with one value, or row, for each run.

    Raises
    ------
    SceneError
        There is no column, or columns differ in length.
    """
    counts = {len(values) for values in columns}
    if len(counts) != 1:
        raise SceneError(f"{scene.name}: columns have {sorted(counts)} values; give one for each run, in every column")
    return counts.pop()


def run_batch(
    scene: Scene,
    parameters: Mapping[str, Sequence[float] | np.ndarray] | None = None,
    inputs: Mapping[str, np.ndarray] | None = None,
    outputs: Sequence[str] = ("rod.tip.p",),
    threads: int | None = None,
) -> BatchResult:
    """Run a scene many times.

    Parameters
    ----------
    scene
        A scene with macro steps of one length and FMUs of this project; algebraic loops are solved by quasi-Newton.
    parameters
        Name 'member.parameter' -> values (runs,) in the parameter's unit; a vector has one value for all elements.
    inputs
        Name 'member.input' -> values (runs, steps), or (runs, steps, n) for a vector of n, held over each macro step.
        Inputs that are not given follow the scene.
    outputs
        Names of Real inputs and outputs, vectors whole.
    threads
        Number of threads; default: one for each core.

    Raises
    ------
    SceneError
        The engine cannot run the scene, a name is not known, or shapes do not fit.
    SubsystemError
        No instance of an FMU can be made.
    Interrupted
        The user stops it (Ctrl-C). Its `partial` is the result until then, with 'stopped' as the failure of other runs.

    That FMUs warn comes as one FmuWarning.
    """
    parameters, inputs = dict(parameters or {}), dict(inputs or {})
    plan = EnginePlan.of(scene, list(parameters), list(inputs), outputs)
    runs = count_runs(scene, (*parameters.values(), *inputs.values()))
    table = np.column_stack(
        [np.zeros((runs, 0)), *(np.asarray(v, dtype=float).reshape(runs, 1) for v in parameters.values())]
    )
    courses = None
    if inputs:
        steps = plan.times.size - 1
        try:
            parts = [np.asarray(values, dtype=float).reshape(runs, steps, -1) for values in inputs.values()]
            courses = np.concatenate(parts, axis=2)
        except ValueError as error:
            raise SceneError(f"{scene.name}: inputs have {runs} runs of {steps} macro steps each: {error}") from error
        if courses.shape[2] != len(plan.inputs):
            raise SceneError(f"{scene.name}: inputs have {len(plan.inputs)} columns, {', '.join(plan.inputs)}")
    try:
        rows, failures, warned = run_plan(plan, table, courses, threads)
    except Interrupted as error:
        error.partial = _result(plan, *error.partial)
        raise
    if text := summary_of_warnings(warned):
        warnings.warn(text, FmuWarning, stacklevel=2)
    return _result(plan, rows, failures, warned)


def summary_of_warnings(texts: Sequence[str]) -> str:
    """Return how many runs have a warning, and the first one; empty where none has."""
    warned = [k for k, text in enumerate(texts) if text]
    if not warned:
        return ""
    return f"{len(warned)} of {len(texts)} runs warn, the first, run {warned[0]}, with: {texts[warned[0]]}"


def _result(plan: EnginePlan, rows: np.ndarray, failures: tuple[str, ...], warned: tuple[str, ...]) -> BatchResult:
    return BatchResult(plan.times, rows[:, 0], rows[:, 1:], failures, warned, plan.outputs)


def run_plan(
    plan: EnginePlan, table: np.ndarray, courses: np.ndarray | None = None, threads: int | None = None
) -> tuple[np.ndarray, tuple[str, ...], tuple[str, ...]]:
    """Run a plan.

    Parameters
    ----------
    plan
        What is run.
    table : ndarray, shape (runs, parameters)
        Values of the parameters.
    courses : ndarray, shape (runs, steps, n_u), or None
        Inputs, held over each step.
    threads
        Number of threads; default: one for each core.

    Returns
    -------
    tuple
        Outputs (runs, steps + 1, n_y) at the start and the ends of the steps, and the texts of failures and of warnings
        (runs,).

    Raises
    ------
    SceneError
        A number is not finite.
    SubsystemError
        No instance of an FMU can be made.
    Interrupted
        The user stops it; its `partial` is what would be returned, with 'stopped' as the failure of other runs.
    """
    for what, values in (("parameters", table), ("inputs", courses)):
        if values is not None and not np.isfinite(values).all():
            raise SceneError(f"{plan.scene.name}: {what} have numbers that are not finite; give finite ones")
    runs = len(table)
    rows = np.empty((runs, plan.times.size, plan.width))
    texts, warned = (ctypes.create_string_buffer(max(runs, 1) * MAX_TEXT) for _ in range(2))
    array = ctypes.POINTER(ctypes.c_double)
    table = np.ascontiguousarray(table, dtype=float)
    courses = None if courses is None else np.ascontiguousarray(courses, dtype=float)
    call = WatchedCall(
        library().tca_batch,
        ctypes.byref(plan.structure),
        runs,
        table.shape[1],
        table.ctypes.data_as(array),
        None if courses is None else courses.ctypes.data_as(array),
        rows.ctypes.data_as(array),
        threads or cores(),
        texts,
        warned,
        MAX_TEXT,
    )
    failed = call.wait()
    said = tuple(_text(texts, k) for k in range(runs))
    warnings_of_runs = tuple(_text(warned, k) for k in range(runs))
    if failed < 0:
        raise SubsystemError(said[0] if said else "no instance can be made")
    if call.is_stopped:
        stopped = Interrupted(f"stopped by the user after {said.count('')} of {runs} runs")
        stopped.partial = rows, said, warnings_of_runs
        raise stopped
    return rows, said, warnings_of_runs


def _text(texts: ctypes.Array[ctypes.c_char], run: int) -> str:
    """Return the text of one run. The buffer is not copied: most are empty."""
    begin = ctypes.addressof(texts) + run * MAX_TEXT
    return ctypes.string_at(begin).decode("utf-8", "replace")
