"""Cost and true error of the levels around a selection: how near it is to the cheapest choice that is good enough."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from ...errors import CosimError
from .hierarchy import Choice, Hierarchies, apply_choice
from .measure import relative_error
from .reference_level import reference_choice
from .runs import ResumableRun, RunCache
from .selection import Selection

__all__ = ["ChoiceRating", "CostStudy", "RatedChoice", "candidates", "cost_study"]

_STEPS = 2  # level of the rod's tolerance that is tried at least
_REPEATS = 5  # runs of which the fastest counts; fewer where one takes longer than _SHORT
_SHORT = 0.5  # [s] of CPU, above which disturbances by other processes matter little
_REPEATED = 4  # candidates that are run again: the cheapest by their first run
_COST_LIMIT = 1.3  # times the cost of the most expensive selection, above which a candidate cannot be the cheapest


@dataclass(frozen=True)
class RatedChoice:
    """A choice with its true error (share of the range; inf: failed or too expensive) and CPU time [s]."""

    choice: Choice
    error: float
    cost: float


@dataclass(frozen=True)
class CostStudy:
    """Rating of one selection; best: the cheapest candidate that meets the tolerance."""

    rated: tuple[RatedChoice, ...]
    chosen: RatedChoice
    best: RatedChoice

    @property
    def ratio(self) -> float:
        """Cost of the selection over that of the best candidate."""
        return self.chosen.cost / self.best.cost


def candidates(hierarchies: Hierarchies, choices: Sequence[Choice]) -> Iterator[Choice]:
    """Choices that may be cheaper: what is finer in everything comes after what is coarser.

    All models of the rod, with time steps from the coarsest to the finest chosen and with the choices' finest heat and
    longest macro step, both of which cost little or nothing; then the coarsest heat with the rods chosen.
    """
    finest = {h.name: max(choice[h.name] for choice in choices) for h in hierarchies}
    fixed = {**finest, "macro": min(choice["macro"] for choice in choices)}
    varied = {h.name: range(len(h.levels)) for h in hierarchies if h.name in ("strains", "inertia", "order")}
    for values in product(*varied.values()):
        choice = {**fixed, **dict(zip(varied, values, strict=True))}
        steps = range(max(_STEPS, finest.get("step", 0)) + 1)
        yield from ({**choice, "step": step} for step in steps) if choice.get("inertia") else [choice]
    yield from ({**choice, "heat": 0} for choice in choices if "heat" in choice)


def cost_study(
    selections: Sequence[Selection], progress: Callable[[int, int], None] = lambda done, count: None
) -> list[CostStudy]:
    """Rate selections for one scene and several tolerances against all candidates.

    Runs the selections, the reference and every candidate that is not too expensive, over the whole scene.
    progress(done, count) is called before each candidate.
    """
    hierarchies, chosen = selections[0].hierarchies, [selection.search.choice for selection in selections]
    rating = ChoiceRating(selections)
    rated = [rating.rate(choice) for choice in chosen]
    rating.limit = _COST_LIMIT * max(choice.cost for choice in rated)
    others = [choice for choice in candidates(hierarchies, chosen) if choice not in chosen]
    for done, choice in enumerate(others):
        progress(done, len(others))
        rated.append(rating.rate(choice))
    return [_study(selection, own, rated) for selection, own in zip(selections, rated, strict=False)]


class ChoiceRating:
    """Measures cost and true error of one choice after the other.

    Attributes
    ----------
    limit : float
        CPU time of a run [s]. A run that exceeds it is stopped, and choices that are nowhere coarser are not tried.
    """

    def __init__(self, selections: Sequence[Selection]) -> None:
        self._runs = RunCache(selections[0].scene)
        self._stop = self._runs.scene.stop_time
        choices = [selection.search.choice for selection in selections]
        tolerance = min(selection.scene.accuracy.tolerance for selection in selections)
        with contextlib.closing(self._runs):
            best = reference_choice(self._runs, selections[0].hierarchies, choices, tolerance)
            self._reference = self._runs(best, self._stop).trajectory(self._runs.quantities, self._stop)
        self._too_expensive: list[Choice] = []
        self.limit = math.inf

    def rate(self, choice: Choice) -> RatedChoice:
        """Run one choice; infinite error and cost where it fails or exceeds the limit."""
        if any(all(choice[name] >= level for name, level in other.items()) for other in self._too_expensive):
            return RatedChoice(choice, math.inf, math.inf)
        quantities = self._runs.quantities
        run = ResumableRun(apply_choice(self._runs.scene, choice))
        with contextlib.closing(run):
            try:
                if run.advance_to(self._stop, self.limit):
                    trajectory = run.trajectory(quantities, self._stop)
                    return RatedChoice(choice, relative_error(trajectory, self._reference, quantities), run.cost)
                self._too_expensive.append(choice)
            except CosimError:
                pass
        return RatedChoice(choice, math.inf, math.inf)


def _study(selection: Selection, chosen: RatedChoice, rated: Sequence[RatedChoice]) -> CostStudy:
    tolerance = selection.scene.accuracy.tolerance
    good = [other for other in rated if other.error <= tolerance and other is not chosen]
    repeated = [chosen, *sorted(good, key=lambda other: other.cost)[:_REPEATED]]
    repeats = min(_REPEATS, math.ceil(_REPEATS * _SHORT / chosen.cost))
    rounds = [[_cost(selection, other.choice) for other in repeated] for _ in range(repeats)]
    again = [RatedChoice(v.choice, v.error, min(costs)) for v, *costs in zip(repeated, *rounds, strict=True)]
    enough = [other for other in again if other.error <= tolerance]
    return CostStudy(tuple(rated), again[0], min(enough or again, key=lambda other: other.cost))


def _cost(selection: Selection, choice: Choice) -> float:
    run = ResumableRun(apply_choice(selection.scene, choice))
    with contextlib.closing(run):
        run.advance_to(selection.scene.stop_time)
    return run.cost
