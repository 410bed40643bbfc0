"""No more model than a scene needs: a choice for what it asks, checked on what the choice has not seen, with its
reasons."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import xarray as xr

from ... import simulation
from ...scene import Scene
from .dimensionless_numbers import Numbers, numbers
from .explanation import brief, reasons
from .hierarchy import Choice, Ladder, ladder, settings
from .proposal import propose
from .reference_level import truth
from .runs import Run, Runs
from .search import Found, climb, descend

__all__ = ["Selection", "Told", "audit", "run", "select"]

SEEN = 0.4  # share of the scene that the climb looks at; the rest is the check
_TERMS = ("model", "space", "time", "coupling")

Told = Callable[[str], None]  # hears in a few words what a search is at


@dataclass(frozen=True)
class Selection:
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

    def record(self, true: float | None = None) -> dict[str, Any]:
        """What a result says of it, None for errors that no run could tell. Times are CPU times [s]: of the run after
        loading, of the search with it. true: the error that an audit found."""
        terms = {term: sum(self.found.gaps[a.name] for a in self.ladder if a.term == term) for term in _TERMS}
        shares = {**terms, "estimate": self.found.estimate, **({} if true is None else {"true_error": true})}
        return {
            "choice": settings(self.scene, self.found.choice),
            "reasons": reasons(self.ladder, self.found, self.numbers),
            "budget": {
                "tolerance": self.scene.accuracy.tolerance,
                "quantities": list(self.runs.asked),
                **{name: share if math.isfinite(share) else None for name, share in shares.items()},
                "runs": self.runs.made,
                "search_s": self.search,
                "run_s": self.run.cost,
            },
        }

    def result(self, true: float | None = None) -> xr.Dataset:
        """Of the run with the choice, which the attribute `fidelity` explains (JSON of record())."""
        return self.run.result.assign_attrs(fidelity=json.dumps(self.record(true), allow_nan=False))


@dataclass
class _Account:
    """Says what a search is at."""

    tell: Told
    ladder: Ladder
    runs: int = 0
    estimate: str = ""

    def begun(self, choice: Choice) -> None:
        self.runs += 1
        self.tell(f"run {self.runs}{self.estimate}: {brief(self.ladder, choice)}")

    def tried(self, choice: Choice, estimate: float) -> None:
        self.estimate = f", last estimate {estimate:.1e}"


def select(
    scene: Scene,
    tell: Told = lambda text: None,
    axes: Ladder | None = None,
    watch: Callable[[float], None] = lambda time: None,
) -> Selection:
    """For the quantities and the tolerance that the scene asks for. axes: those of ladder(scene) that are free, all
    unless given; on the others the scene's own models stay. watch hears of the time of every macro step of every run.
    Raises CosimError where no level meets the tolerance, SceneError where nothing is asked for."""
    begin = time.thread_time()
    axes = ladder(scene) if axes is None else axes
    screened, tolerance = numbers(scene), scene.accuracy.tolerance
    stop, macro = scene.stop_time, scene.coupling.macro_step
    window = min(stop, max(1.0, round(SEEN * stop / macro)) * macro)
    said = _Account(tell, axes)
    with contextlib.closing(Runs(scene, said.begun, watch)) as runs:
        choice = climb(runs, axes, propose(axes, screened, tolerance), tolerance, window, said.tried)
        choice = climb(runs, axes, choice, tolerance, stop, said.tried)  # ends at once where the rest is as the window
        found = descend(runs, axes, choice, tolerance, stop, said.tried)
    return Selection(scene, runs, axes, screened, found, time.thread_time() - begin)


def audit(found: Selection) -> float:
    """The true error of a choice, over the whole scene."""
    choice, runs = found.found.choice, found.runs
    with contextlib.closing(runs):
        return runs.gap(
            choice, truth(runs, found.ladder, [choice], found.scene.accuracy.tolerance), found.scene.stop_time
        )


def run(
    scene: Scene, progress: Callable[[float], None] = lambda time: None, tell: Told = lambda text: None
) -> xr.Dataset:
    """simulate.run, with the models chosen where the scene says level = "auto"; tell hears of that, progress of the
    time that a run with given models has come to."""
    return simulation.run(scene, progress) if scene.accuracy.level == "given" else select(scene, tell).result()
