"""No more model than a scene needs: a choice for what it asks, checked on what the choice has not seen, with its
reasons."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass

import xarray as xr

from .. import simulate
from ..scene import Scene
from .climb import Found, Tell, climb, descend
from .ladder import Choice, Ladder, ladder, settings
from .proposal import propose
from .runs import Run, Runs
from .screens import Numbers, numbers
from .words import reasons

__all__ = ["Fit", "audit", "fit", "run", "top"]

SEEN = 0.4  # share of the scene that the climb looks at; the rest is the check
_TERMS = ("model", "space", "time", "coupling")
_FINEST = 2  # halvings of the macro step in the top level, beyond the choice's own


@dataclass(frozen=True)
class Fit:
    scene: Scene
    runs: Runs
    ladder: Ladder
    numbers: Numbers
    found: Found
    search: float  # CPU time of everything before the chosen run [s]

    @property
    def run(self) -> Run:
        """With the choice, to the end."""
        return self.runs(self.found.choice, self.scene.stop_time)

    def record(self, true: float | None = None) -> dict[str, object]:
        """What a result says of it. Times are CPU times [s]: of the run after loading, of the search with it. true:
        the error that an audit found."""
        terms = {term: sum(self.found.gaps[a.name] for a in self.ladder if a.term == term) for term in _TERMS}
        return {
            "choice": settings(self.scene, self.found.choice),
            "reasons": reasons(self.ladder, self.found, self.numbers),
            "budget": {
                "tolerance": self.scene.asked.tolerance,
                "quantities": list(self.runs.asked),
                **terms,
                "estimate": self.found.estimate,
                "runs": self.runs.made,
                "search_s": self.search,
                "run_s": self.run.cost,
                **({} if true is None else {"true_error": true}),
            },
        }

    def result(self, true: float | None = None) -> xr.Dataset:
        """Of the run with the choice, which the attribute `fidelity` explains (JSON of record())."""
        return self.run.result.assign_attrs(fidelity=json.dumps(self.record(true)))


def fit(scene: Scene, tell: Tell = lambda choice, estimate: None) -> Fit:
    """For the quantities and the tolerance that the scene asks for. tell: hears of every choice tried and its
    estimated error. Raises CosimError where no level meets the tolerance, SceneError where nothing is asked for."""
    begin = time.thread_time()
    runs, axes, screened = Runs(scene), ladder(scene), numbers(scene)
    tolerance, stop, macro = scene.asked.tolerance, scene.stop_time, scene.coupling.macro_step
    window = min(stop, max(1.0, round(SEEN * stop / macro)) * macro)
    choice = climb(runs, axes, propose(axes, screened, tolerance), tolerance, window, tell)
    choice = climb(runs, axes, choice, tolerance, stop, tell)  # ends at once where the rest brings nothing new
    found = descend(runs, axes, choice, tolerance, stop, tell)
    return Fit(scene, runs, axes, screened, found, time.thread_time() - begin)


def audit(found: Fit) -> float:
    """The true error of a choice: against the last rung of every axis, over the whole scene."""
    return found.runs.gap(found.found.choice, top(found.ladder, found.found.choice), found.scene.stop_time)


def top(axes: Ladder, choice: Choice) -> Choice:
    last = {axis.name: len(axis.rungs) - 1 for axis in axes}
    return {**last, "macro": min(choice["macro"] + _FINEST, last["macro"])}


def run(scene: Scene, progress: Callable[[float], None] = lambda time: None) -> xr.Dataset:
    """simulate.run, with the models chosen where the scene says level = "auto"."""
    if scene.asked.level == "given":
        return simulate.run(scene, progress)
    found = fit(scene)
    progress(scene.stop_time)
    return found.result()
