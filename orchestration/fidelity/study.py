"""What every level costs and how far off it is: whether a choice is near the cheapest that is good enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

from ..errors import CosimError
from .fit import Fit, top
from .ladder import Choice, Ladder
from .runs import Runs

__all__ = ["Level", "Study", "candidates", "study"]

_STEPS = (1, 3, 5)  # rungs of the rod's tolerance that are tried where time steps cost
_REPEATS = 5  # of the runs whose cost decides; the least counts
_DECIDING = 4  # levels that are run again, the cheapest by their first run


@dataclass(frozen=True)
class Level:
    choice: Choice
    error: float  # true, share of the range; inf where the run fails
    cost: float  # CPU time after loading [s]


@dataclass(frozen=True)
class Study:
    levels: tuple[Level, ...]
    chosen: Level
    best: Level  # the cheapest that meets the tolerance

    @property
    def ratio(self) -> float:
        return self.chosen.cost / self.best.cost


def candidates(axes: Ladder, choice: Choice) -> Iterator[Choice]:
    """All models of the rod, and lumped heat; heat and macro step of the choice otherwise: they cost next to nothing,
    or are the least there is."""
    rungs = {a.name: range(len(a.rungs)) for a in axes if a.name in ("strains", "inertia", "order")}
    heats = {choice["heat"], 0} if "heat" in choice else {None}
    for heat, *values in product(heats, *rungs.values()):
        level = {**choice, **dict(zip(rungs, values, strict=True)), **({} if heat is None else {"heat": heat})}
        steps = _STEPS if level.get("inertia") else [choice["step"]] if "step" in choice else [None]
        yield from ({**level, **({} if step is None else {"step": step})} for step in steps)


def study(found: Fit, tell: Callable[[int, int], None] = lambda done, of: None) -> Study:
    """Runs all candidates and the top level over the whole scene. tell(done, of): progress."""
    runs, stop, tolerance = Runs(found.scene), found.scene.stop_time, found.scene.asked.tolerance
    truth = top(found.ladder, found.found.choice)
    tried = [c for c in candidates(found.ladder, found.found.choice) if c != found.found.choice]
    levels = []
    for choice in (found.found.choice, *tried):
        levels.append(Level(choice, runs.gap(choice, truth, stop), _cost(runs, choice, stop)))
        tell(len(levels), len(tried) + 1)
    good = sorted((level for level in levels if level.error <= tolerance), key=lambda level: level.cost)
    deciding = [levels[0], *(level for level in good[:_DECIDING] if level is not levels[0])]
    again = _measured(found, deciding)
    return Study(tuple(levels), again[0], min(again, key=lambda level: level.cost))


def _cost(runs: Runs, choice: Choice, stop: float) -> float:
    try:
        return runs(choice, stop).cost
    except CosimError:
        return float("inf")


def _measured(found: Fit, levels: list[Level]) -> list[Level]:
    """The levels with their least cost of several runs, in turn."""
    stop = found.scene.stop_time
    rounds = [[Runs(found.scene)(level.choice, stop).cost for level in levels] for _ in range(_REPEATS)]
    return [
        Level(level.choice, level.error, min(costs))
        for level, costs in zip(levels, zip(*rounds, strict=True), strict=True)
    ]
