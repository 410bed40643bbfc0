"""Profile of a run: CPU time of loading, of the FMUs' own C functions and of the master around them.

CPU time of the thread, so that other processes disturb little; the smallest of several runs.
"""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass

from ..scene import Scene
from ..simulation import open_simulation

__all__ = ["RunProfile", "profile_run"]


@dataclass(frozen=True)
class RunProfile:
    """CPU times and counts of one run."""

    load: float  # [s] from the FMU files to the first macro step
    run: float  # [s] from there to the stop time
    fmus: float  # [s] of that inside the FMUs
    steps: int
    sweeps: float  # mean per macro step

    @property
    def overhead(self) -> float:
        """CPU time of the master per macro step [s]."""
        return (self.run - self.fmus) / self.steps


class _TimedLibrary:
    """Proxy of a library that measures the CPU time of every call."""

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


def profile_run(scene: Scene, repeats: int = 5) -> RunProfile:
    """Run a scene 2 * repeats times: unobserved for the totals, then observed for the share of the FMUs."""
    bare = min((_unobserved(scene) for _ in range(repeats)), key=lambda profile: profile.run)
    own = min(_fmu_time(scene) for _ in range(repeats))
    return RunProfile(bare.load, bare.run, own, bare.steps, bare.sweeps)


def _unobserved(scene: Scene) -> RunProfile:
    begin = time.thread_time()
    with open_simulation(scene) as ready:
        loaded = time.thread_time()
        logs = list(ready.steps())
        end = time.thread_time()
    return RunProfile(loaded - begin, end - loaded, 0.0, len(logs), sum(log.sweeps for log in logs) / len(logs))


def _fmu_time(scene: Scene) -> float:
    with open_simulation(scene) as ready:
        libraries: list[_TimedLibrary] = []

        def watch(library: ctypes.CDLL) -> _TimedLibrary:
            libraries.append(_TimedLibrary(library))
            return libraries[-1]

        for slave in ready.slaves:
            slave.watch_calls(watch)
        for _ in ready.steps():
            pass
        spent = sum(library.spent for library in libraries)
        for slave in ready.slaves:
            slave.watch_calls(lambda watched: watched.library)  # what follows is not part of the run
        return spent
