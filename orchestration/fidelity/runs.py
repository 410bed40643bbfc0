"""Runs of a scene with one choice after the other, each made once: what was asked for, and what it cost."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import xarray as xr

from ..errors import CosimError
from ..scene import Scene
from ..simulate import prepared, solved
from .ladder import Choice, applied
from .measure import error, quantities

__all__ = ["Run", "Runs"]


@dataclass(frozen=True)
class Run:
    result: xr.Dataset
    cost: float  # CPU time after loading [s]


class Runs:
    """spent: CPU time of all runs with loading [s]; made: how many."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.asked = quantities(scene)
        self.spent, self.made = 0.0, 0
        self._known: dict[tuple[object, ...], Run | CosimError] = {}

    def __call__(self, choice: Choice, stop: float) -> Run:
        """The run with that choice until `stop` [s]. Raises the error with which it ended."""
        key = (stop, *sorted(choice.items()))
        if key not in self._known:
            begin = time.thread_time()
            try:
                self._known[key] = self._run(choice, stop)
            except CosimError as failure:
                self._known[key] = failure
            self.spent += time.thread_time() - begin
            self.made += 1
        found = self._known[key]
        if isinstance(found, CosimError):
            raise found
        return found

    def gap(self, choice: Choice, better: Choice, stop: float) -> float:
        """How far the two lie apart in what is asked for, share of its range; inf where the first fails."""
        other = self(better, stop).result
        try:
            return error(self(choice, stop).result, other, self.asked)
        except CosimError:
            return float("inf")

    def _run(self, choice: Choice, stop: float) -> Run:
        with prepared(applied(replace(self.scene, stop_time=stop), choice)) as ready:
            begin = time.thread_time()
            result = solved(ready)
            return Run(result, time.thread_time() - begin)
