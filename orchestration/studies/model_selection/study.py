"""What every level costs and how far off it is: whether a choice is near the cheapest that is good enough."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from ...errors import CosimError
from .hierarchy import Choice, Ladder, applied
from .measure import error
from .reference_level import truth
from .runs import Run, Runs
from .selection import Selection

__all__ = ["Judge", "Level", "Study", "candidates", "study"]

_STEPS = 2  # rung of the rod's tolerance that is tried at least
_REPEATS = 5  # of the runs whose cost decides, the least counts; fewer where one takes longer than _QUIET
_QUIET = 0.5  # [s] from which on what a processor does besides matters little
_DECIDING = 4  # levels that are run again, the cheapest by their first run
_DEAR = 1.3  # times the cost of the dearest choice: what costs more is none that a choice could be dearer than


@dataclass(frozen=True)
class Level:
    choice: Choice
    error: float  # true, share of the range; inf where the run fails or is too dear
    cost: float  # CPU time after loading [s]


@dataclass(frozen=True)
class Study:
    """Of one choice."""

    levels: tuple[Level, ...]
    chosen: Level
    best: Level  # the cheapest that meets the tolerance

    @property
    def ratio(self) -> float:
        return self.chosen.cost / self.best.cost


def candidates(axes: Ladder, choices: Sequence[Choice]) -> Iterator[Choice]:
    """All models of the rod, with time steps from the coarsest up to the finest chosen, and with the choices' finest
    heat and longest macro step, both of which cost next to nothing or nothing; and the least model of the heat with
    the rods chosen. What is finer in all comes after what is coarser."""
    finest = {a.name: max(choice[a.name] for choice in choices) for a in axes}
    fixed = {**finest, "macro": min(choice["macro"] for choice in choices)}
    rungs = {a.name: range(len(a.rungs)) for a in axes if a.name in ("strains", "inertia", "order")}
    for values in product(*rungs.values()):
        level = {**fixed, **dict(zip(rungs, values, strict=True))}
        steps = range(max(_STEPS, finest.get("step", 0)) + 1)
        yield from ({**level, "step": step} for step in steps) if level.get("inertia") else [level]
    yield from ({**choice, "heat": 0} for choice in choices if "heat" in choice)


def study(founds: Sequence[Selection], tell: Callable[[int, int], None] = lambda done, of: None) -> list[Study]:
    """Of choices for one scene and several tolerances: runs them, the top level, and all candidates that are not too
    dear, over the whole scene. tell(done, of): progress."""
    axes, chosen = founds[0].ladder, [found.found.choice for found in founds]
    judge = Judge(founds)
    levels = [judge.level(choice) for choice in chosen]
    judge.limit = _DEAR * max(level.cost for level in levels)
    others = [choice for choice in candidates(axes, chosen) if choice not in chosen]
    for done, choice in enumerate(others):
        tell(done, len(others))
        levels.append(judge.level(choice))
    return [_judged(found, level, levels) for found, level in zip(founds, levels, strict=False)]


class Judge:
    """Tells cost and true error of one level after the other. limit: of the cost of a run [s]; one that is over it is
    stopped, and what is finer in something and coarser in nothing is not tried."""

    def __init__(self, founds: Sequence[Selection]) -> None:
        self._runs = Runs(founds[0].scene)
        self._stop = self._runs.scene.stop_time
        choices = [found.found.choice for found in founds]
        with contextlib.closing(self._runs):
            best = truth(self._runs, founds[0].ladder, choices, min(f.scene.accuracy.tolerance for f in founds))
            self._truth = self._runs(best, self._stop).course(self._runs.asked, self._stop)
        self._dear: list[Choice] = []
        self.limit = math.inf

    def level(self, choice: Choice) -> Level:
        if any(all(choice[axis] >= rung for axis, rung in dear.items()) for dear in self._dear):
            return Level(choice, math.inf, math.inf)
        run = Run(applied(self._runs.scene, choice))
        with contextlib.closing(run):
            try:
                if run.reach(self._stop, self.limit):
                    course = run.course(self._runs.asked, self._stop)
                    return Level(choice, error(course, self._truth, self._runs.asked), run.cost)
                self._dear.append(choice)
            except CosimError:
                pass
        return Level(choice, math.inf, math.inf)


def _judged(found: Selection, chosen: Level, levels: Sequence[Level]) -> Study:
    good = [level for level in levels if level.error <= found.scene.accuracy.tolerance and level is not chosen]
    deciding = [chosen, *sorted(good, key=lambda level: level.cost)[:_DECIDING]]
    repeats = min(_REPEATS, math.ceil(_REPEATS * _QUIET / chosen.cost))
    rounds = [[_cost(found, level.choice) for level in deciding] for _ in range(repeats)]
    again = [Level(v.choice, v.error, min(costs)) for v, *costs in zip(deciding, *rounds, strict=True)]
    enough = [level for level in again if level.error <= found.scene.accuracy.tolerance]
    return Study(tuple(levels), again[0], min(enough or again, key=lambda level: level.cost))


def _cost(found: Selection, choice: Choice) -> float:
    run = Run(applied(found.scene, choice))
    with contextlib.closing(run):
        run.reach(found.scene.stop_time)
    return run.cost
