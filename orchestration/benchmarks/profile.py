"""Profile of a run: CPU time of loading, of the calls of the FMUs and of the master around them.

CPU time of the thread, so that other processes disturb little; the smallest of several runs. The master measures the
calls of the FMUs by the clock.
"""

from __future__ import annotations

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
    fmus: float  # [s] of that in calls of the FMUs
    steps: int
    sweeps: float  # mean per macro step

    @property
    def overhead(self) -> float:
        """CPU time of the master per macro step [s]."""
        return (self.run - self.fmus) / self.steps


def profile_run(scene: Scene, repeats: int = 5) -> RunProfile:
    """Run a scene several times and return the profile of the fastest run."""
    return min((_profile(scene) for _ in range(repeats)), key=lambda profile: profile.run)


def _profile(scene: Scene) -> RunProfile:
    begin = time.thread_time()
    with open_simulation(scene) as ready:
        loaded = time.thread_time()
        logs = list(ready.steps())
        run = time.thread_time() - loaded
        fmus = sum(node.seconds for node in ready.master.nodes)
    return RunProfile(loaded - begin, run, min(fmus, run), len(logs), sum(log.sweeps for log in logs) / len(logs))
