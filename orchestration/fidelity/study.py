"""What every level costs and how far off it is: whether a choice is near the cheapest that is good enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from ..errors import CosimError
from .fit import Fit, top
from .ladder import Choice, Ladder
from .runs import Runs

__all__ = ["Level", "Study", "candidates", "study"]

_STEPS = (1, 4)  # rungs of the rod's tolerance that are tried where time steps cost
_REPEATS = 5  # of the runs whose cost decides; the least counts
_DECIDING = 4  # levels that are run again, the cheapest by their first run


@dataclass(frozen=True)
class Level:
    choice: Choice
    error: float  # true, share of the range; inf where the run fails
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
    """All models of the rod with the choices' finest heat and longest macro step, both of which cost next to nothing
    or nothing, and the least model of the heat with the rods chosen."""
    finest = {a.name: max(choice[a.name] for choice in choices) for a in axes}
    fixed = {**finest, "macro": min(choice["macro"] for choice in choices)}
    rungs = {a.name: range(len(a.rungs)) for a in axes if a.name in ("strains", "inertia", "order")}
    for values in product(*rungs.values()):
        level = {**fixed, **dict(zip(rungs, values, strict=True))}
        yield from ({**level, "step": step} for step in _STEPS) if level.get("inertia") else [level]
    yield from ({**choice, "heat": 0} for choice in choices if "heat" in choice)


def study(founds: Sequence[Fit], tell: Callable[[int, int], None] = lambda done, of: None) -> list[Study]:
    """Of choices for one scene and several tolerances: runs them, all candidates and the top level over the whole
    scene. tell(done, of): progress."""
    scene, axes = founds[0].scene, founds[0].ladder
    chosen = [found.found.choice for found in founds]
    runs, stop = Runs(scene), scene.stop_time
    truth = top(axes, max(chosen, key=lambda choice: choice["macro"]))
    tried = list({tuple(sorted(c.items())): c for c in (*chosen, *candidates(axes, chosen))}.values())
    levels = {}
    for choice in tried:
        levels[tuple(sorted(choice.items()))] = Level(choice, runs.gap(choice, truth, stop), _cost(runs, choice, stop))
        tell(len(levels), len(tried))
    return [_judged(found, levels[tuple(sorted(found.found.choice.items()))], levels.values()) for found in founds]


def _judged(found: Fit, chosen: Level, levels: Sequence[Level]) -> Study:
    good = [level for level in levels if level.error <= found.scene.asked.tolerance and level is not chosen]
    deciding = [chosen, *sorted(good, key=lambda level: level.cost)[:_DECIDING]]
    stop = found.scene.stop_time
    rounds = [[Runs(found.scene)(level.choice, stop).cost for level in deciding] for _ in range(_REPEATS)]
    again = [Level(v.choice, v.error, min(costs)) for v, *costs in zip(deciding, *rounds, strict=True)]
    return Study(tuple(levels), again[0], min(again, key=lambda level: level.cost))


def _cost(runs: Runs, choice: Choice, stop: float) -> float:
    try:
        return runs(choice, stop).cost
    except CosimError:
        return float("inf")
