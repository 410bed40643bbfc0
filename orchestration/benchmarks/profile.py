"""Where the time of a run goes: loading, the FMUs' own C functions, the master around them.

CPU time of the thread, so that other work on the machine counts little; the least of several runs.
"""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass

from ..scene import Scene
from ..simulation import open_simulation

__all__ = ["Timing", "measure"]


@dataclass(frozen=True)
class Timing:
    load: float  # [s] from the FMU files to the first macro step
    run: float  # [s] from there to the stop time
    fmus: float  # [s] of that inside the FMUs
    steps: int
    sweeps: float  # mean per macro step

    @property
    def overhead(self) -> float:
        """Of the master, per macro step [s]."""
        return (self.run - self.fmus) / self.steps


class _Watched:
    """The functions of a library with a clock around every call."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self.library, self.spent = library, 0.0

    def __getattr__(self, name: str) -> object:
        function = getattr(self.library, name)

        def timed(*arguments: object) -> object:
            begin = time.thread_time()
            result = function(*arguments)
            self.spent += time.thread_time() - begin
            return result

        setattr(self, name, timed)
        return timed


def measure(scene: Scene, repeats: int = 5) -> Timing:
    """Runs the scene 2 * repeats times: bare for the totals, then watched for the FMUs' share."""
    bare = min((_bare(scene) for _ in range(repeats)), key=lambda timing: timing.run)
    own = min(_watched(scene) for _ in range(repeats))
    return Timing(bare.load, bare.run, own, bare.steps, bare.sweeps)


def _bare(scene: Scene) -> Timing:
    begin = time.thread_time()
    with open_simulation(scene) as ready:
        loaded = time.thread_time()
        logs = list(ready.steps())
        end = time.thread_time()
    return Timing(loaded - begin, end - loaded, 0.0, len(logs), sum(log.sweeps for log in logs) / len(logs))


def _watched(scene: Scene) -> float:
    with open_simulation(scene) as ready:
        libraries: list[_Watched] = []

        def watch(library: ctypes.CDLL) -> _Watched:
            libraries.append(_Watched(library))
            return libraries[-1]

        for slave in ready.slaves:
            slave.watch_calls(watch)
        for _ in ready.steps():
            pass
        spent = sum(library.spent for library in libraries)
        for slave in ready.slaves:
            slave.watch_calls(lambda watched: watched.library)  # what follows is not part of the run
        return spent
