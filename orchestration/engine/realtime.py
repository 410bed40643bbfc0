"""One run of the engine in step with the clock: what each step takes, and which come too late."""

from __future__ import annotations

import ctypes
import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import FmuWarning, Interrupted, SubsystemError
from ..fmi.archive import shipped_folders
from ..scene import Scene
from .batch import MAX_TEXT
from .binding import Times, library
from .plan import EnginePlan
from .watched_call import WatchedCall

__all__ = ["RealtimeResult", "counting_library", "run_realtime"]


@dataclass(frozen=True, eq=False)
class RealtimeResult:
    """Times of a run in step with the clock.

    Attributes
    ----------
    period : float
        Time from one step to the next [s]; 0: as fast as it can.
    durations : ndarray, shape (steps,)
        What the computation of each step took [s], by the clock.
    busy : ndarray, shape (steps,)
        Processor time of each step [s]; nan where the system has no such clock. What the duration exceeds it by, others
        had the core: threads, the kernel, or the host of a virtual machine.
    fixed : ndarray, shape (steps,)
        What an amount of work that is always the same, and about as long as a step, took behind each step [s]; nan
        where the period left no time for it. How it varies is the host's doing.
    misses : int
        Steps that ended after the next one was due.
    own_misses : int
        Steps that had done so too, had the thread had its core from each due time on: by their processor times.
    worst_lateness : float
        Latest beginning of a step after its due time [s].
    allocations : int or None
        Calls of the allocator in all steps; None where they were not counted.
    sweeps : int
        Most sweeps of an algebraic loop in one step; 1 where there is none. A step takes at most as many as
        coupling.max_sweeps allows, then the run ends.
    locked, scheduled : bool
        Whether memory was locked, and whether the thread had a real-time priority.
    core : int or None
        Core that the thread was bound to; None where the system refused.
    times : ndarray, shape (steps + 1,)
        Start and ends of the steps in the scene [s].
    outputs : ndarray, shape (steps + 1, n_y)
        Outputs at these times.
    """

    period: float
    durations: np.ndarray
    busy: np.ndarray
    fixed: np.ndarray
    misses: int
    own_misses: int
    worst_lateness: float
    allocations: int | None
    sweeps: int
    locked: bool
    scheduled: bool
    core: int | None
    times: np.ndarray
    outputs: np.ndarray


def counting_library() -> Path | None:
    """Return the library that counts allocations, to be loaded before the C library; None where there is none."""
    files = (folder / "tca_counting.so" for folder in shipped_folders())
    return next((file for file in files if file.is_file()), None)


def run_realtime(
    scene: Scene,
    period: float,
    outputs: Sequence[str] = ("rod.tip.p",),
    progress: Callable[[float], None] = lambda time: None,
) -> RealtimeResult:
    """Run a scene, each macro step when it is due.

    Parameters
    ----------
    scene
        A scene that the engine can run (run_batch); its macro step is what a step of the clock simulates.
    period
        Time between the beginnings of two macro steps [s]; 0: as fast as it can.
    outputs
        Names of Real inputs and outputs, vectors whole.
    progress
        Called with the time reached in the scene [s], a few times per second.

    Raises
    ------
    SceneError
        The engine cannot run the scene, or a name is not known.
    SubsystemError
        An FMU refuses a step.
    Interrupted
        The user stops it (Ctrl-C). Its `partial` is the result of the steps until then.

    What FMUs warn of comes as FmuWarning.
    """
    plan = EnginePlan.of(scene, [], [], outputs)
    steps = plan.times.size - 1
    rows, durations = np.zeros((steps + 1, plan.width)), np.zeros(steps)
    busy, fixed = np.full(steps, np.nan), np.full(steps, np.nan)
    times = Times(period=period)
    text, warned = (ctypes.create_string_buffer(MAX_TEXT) for _ in range(2))
    array = ctypes.POINTER(ctypes.c_double)
    call = WatchedCall(
        library().tca_realtime,
        ctypes.byref(plan.structure),
        None,
        *(one.ctypes.data_as(array) for one in (rows, durations, busy, fixed)),
        ctypes.byref(times),
        text,
        warned,
        MAX_TEXT,
    )
    if call.wait(lambda done: progress(float(plan.times[done]))):
        raise SubsystemError(text.value.decode("utf-8", "replace"))
    if warned.value:
        warnings.warn(warned.value.decode("utf-8", "replace"), FmuWarning, stacklevel=2)
    counted = "tca_counting" in os.environ.get("LD_PRELOAD", "")
    done = call.done
    result = RealtimeResult(
        period,
        durations[:done],
        busy[:done],
        fixed[:done],
        times.misses,
        times.own_misses,
        times.worst_lateness,
        times.allocations if counted else None,
        times.sweeps,
        bool(times.locked),
        bool(times.scheduled),
        times.core if times.core >= 0 else None,
        plan.times[: done + 1],
        rows[: done + 1],
    )
    if call.is_stopped:
        stopped = Interrupted(f"stopped by the user at t = {plan.times[done]:.6g} s of {scene.stop_time:g} s")
        stopped.partial = result
        raise stopped
    return result
