"""Selection of the models for what a scene asks: search on the first part, check on the whole, reasons recorded."""

from __future__ import annotations

import contextlib
import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ... import simulation
from ...results import ResultTable
from ...scene import Scene
from .dimensionless_numbers import DimensionlessNumbers, dimensionless_numbers
from .explanation import reasons, summary
from .hierarchy import Choice, Hierarchies, choice_settings, model_hierarchies, with_required
from .kept_choice import keep_choice, kept_choice
from .macro_step_search import search_macro_step_last
from .proposal import propose_choice
from .reference_level import reference_choice
from .runs import ResumableRun, RunCache
from .search import Known, SearchResult, coarsen, refine
from .stiff_loops import resolve_stiff_loop, search_stiff_loop

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Selection", "StatusMessage", "audit", "run_selected_table", "select"]

LONGEST_RUN = 60.0  # CPU time of one run of a search [s]: three times that of the dearest known that succeeds (contact)
SEARCH_WINDOW = 0.4  # share of the scene that the search refines on first; the whole is the check
_TERMS = ("model", "space", "time", "coupling")

StatusMessage = Callable[[str], None]  # called with a few words on what a search is doing


@dataclass(frozen=True)
class Selection:
    """The models chosen for a scene.

    Parameters
    ----------
    scene : Scene
        The scene asked for.
    runs : RunCache
        Every run made on the way.
    hierarchies : Hierarchies
        The hierarchies that were searched.
    numbers : DimensionlessNumbers
        What proposed the first choice.
    search : SearchResult
        Choice, its estimated error and the contributions to it.
    search_time : float
        CPU time of everything before the chosen run [s].
    """

    scene: Scene
    runs: RunCache
    hierarchies: Hierarchies
    numbers: DimensionlessNumbers
    search: SearchResult
    search_time: float

    @property
    def run(self) -> ResumableRun:
        """The run with the choice, to the stop time."""
        return self.runs(self.search.choice, self.scene.stop_time)

    def record(self, true: float | None = None) -> dict[str, Any]:
        """What a result says of the selection; None for errors that no run showed.

        true: the error that an audit gave. Times are CPU times [s]: of the run after loading, of the search with
        loading.
        """
        terms = {
            term: sum(self.search.gaps.get(h.name, math.nan) for h in self.hierarchies if h.term == term)
            for term in _TERMS
        }
        shares = {**terms, "estimate": self.search.estimate, **({} if true is None else {"true_error": true})}
        return {
            "choice": choice_settings(self.scene, self.search.choice),
            "reasons": reasons(self.hierarchies, self.search, self.numbers),
            "budget": {
                "tolerance": self.scene.accuracy.tolerance,
                "quantities": list(self.runs.quantities),
                **{name: share if math.isfinite(share) else None for name, share in shares.items()},
                "runs": self.runs.count,
                "search_s": self.search_time,
                "run_s": self.run.cost,
            },
        }

    def result(self, true: float | None = None) -> xr.Dataset:
        """The dataset of the chosen run; its attribute `fidelity` is record() in JSON."""
        return self.table(true).to_xarray()

    def table(self, true: float | None = None) -> ResultTable:
        """The result as result() gives it, as plain arrays."""
        table = self.run.result
        table.attrs["fidelity"] = json.dumps(self.record(true), allow_nan=False)
        return table


@dataclass
class _Status:
    """Words for what a search is doing."""

    show: StatusMessage
    hierarchies: Hierarchies
    runs: int = 0
    estimate: str = ""

    def announce(self, choice: Choice) -> None:
        self.runs += 1
        self.show(f"run {self.runs}{self.estimate}: {summary(self.hierarchies, choice)}")

    def tried(self, choice: Choice, estimate: float) -> None:
        self.estimate = f", last estimate {estimate:.1e}"


def select(
    scene: Scene,
    status: StatusMessage = lambda text: None,
    hierarchies: Hierarchies | None = None,
    watch: Callable[[float], None] = lambda time: None,
) -> Selection:
    """Select the cheapest models whose estimated error meets the scene's tolerance.

    Parameters
    ----------
    scene : Scene
        Says which quantities matter and how exactly (scene.accuracy).
    status : callable
        Called with a few words before every run.
    hierarchies : Hierarchies, optional
        Those of model_hierarchies(scene) that are free, all by default; the scene's own models stay in the others.
    watch : callable
        Called with the time [s] of every macro step of every run.

    Returns
    -------
    Selection

    Raises
    ------
    CosimError
        Where no level meets the tolerance.
    SceneError
        Where the scene asks for nothing.
    """
    begin = time.thread_time()
    searches_all = hierarchies is None  # only then it is what a run with level = "auto" takes
    hierarchies = model_hierarchies(scene) if hierarchies is None else hierarchies
    numbers, tolerance = dimensionless_numbers(scene), scene.accuracy.tolerance
    stop, macro = scene.stop_time, scene.coupling.macro_step
    window = min(stop, max(1.0, round(SEARCH_WINDOW * stop / macro)) * macro)
    shown = _Status(status, hierarchies)
    words = partial(summary, hierarchies)
    with contextlib.closing(RunCache(scene, shown.announce, watch, LONGEST_RUN, words)) as runs:
        choice = propose_choice(hierarchies, numbers, tolerance)
        known: Known = {}
        hierarchies = resolve_stiff_loop(runs, hierarchies, numbers, choice, window)
        requires = next((h.requires for h in hierarchies if h.name == "inertia"), {})
        if any(least > choice[name] + 1 for name, least in requires.items()) and not choice["inertia"]:
            search = search_stiff_loop(runs, hierarchies, choice, tolerance, window, stop, shown.tried)
        elif numbers.loaded_by_others and "macro" in choice:
            choice = with_required(hierarchies, choice)
            search = search_macro_step_last(runs, hierarchies, choice, tolerance, window, stop, shown.tried)
        else:
            choice = with_required(hierarchies, choice)
            for until in (window, stop):  # at once where the rest is alike
                choice = refine(runs, hierarchies, choice, tolerance, until, shown.tried, known)
            search = coarsen(runs, hierarchies, choice, tolerance, stop, shown.tried, known)
    runs.limit = math.inf  # an audit may take its time
    selection = Selection(scene, runs, hierarchies, numbers, search, time.thread_time() - begin)
    if searches_all:
        keep_choice(scene, search.choice, selection.record())
    return selection


def audit(selection: Selection) -> float:
    """True error of a selection over the whole scene, share of the range: against the finest models."""
    choice, runs, scene = selection.search.choice, selection.runs, selection.scene
    with contextlib.closing(runs):
        reference = reference_choice(runs, selection.hierarchies, [choice], scene.accuracy.tolerance)
        return runs.difference(choice, reference, scene.stop_time)


def run_selected_table(
    scene: Scene, progress: Callable[[float], None] = lambda time: None, status: StatusMessage = lambda text: None
) -> ResultTable:
    """Run a scene, with the models selected where it says level = "auto".

    What an earlier search chose for the same scene is taken, unless it says search = "anew"; the record says so
    (budget.reused). progress is called with the time [s] of a run with given models, status with what a selection is
    doing. Raises what simulation.run and select raise.
    """
    if scene.accuracy.level == "given":
        return simulation.run_table(scene, progress)
    known = kept_choice(scene)
    if known is None:
        return select(scene, status).table()
    begin = time.thread_time()
    table = simulation.run_table(known.scene(scene), progress)
    budget = {**known.record["budget"], "run_s": time.thread_time() - begin, "reused": True}
    table.attrs["fidelity"] = json.dumps({**known.record, "budget": budget}, allow_nan=False)
    return table
