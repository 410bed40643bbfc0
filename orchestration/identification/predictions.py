"""Outputs that a scene predicts at the times of measurements, for many sets of parameters at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..engine.batch import run_plan
from ..engine.plan import EnginePlan
from ..errors import CouplingError, SceneError, SubsystemError
from ..fmi.vectors import split_index
from ..scene import Scene, changed
from ..scene.manipulator import CLOSURE_EXCHANGED, ROD
from ..simulation import run_table
from .measurements import Measurements

__all__ = ["Predictor"]


@dataclass
class Predictor:
    """A scene and what was measured of it.

    The displacement loop is closed inside the rod, which has the same solution, so that the engine can run many sets of
    parameters in one call; scenes that it refuses run one by one under the master.
    """

    scene: Scene
    measured: Measurements
    threads: int | None = None  # of the engine; None: one for each core
    runs: int = 0
    failure: str = ""  # of the last call: why a set of parameters could not be run; empty where all could

    def __post_init__(self) -> None:
        self._plan: EnginePlan | None = None
        self._has_plan = True
        exchanged = [rod.name for rod in self.scene.models(ROD) if rod.value("closure") == CLOSURE_EXCHANGED]
        if exchanged:
            inside = {f"{name}.closure": "inside" for name in exchanged}
            self.scene = changed(self.scene, inside, origin="identification")

    def __call__(self, names: Sequence[str], table: np.ndarray) -> np.ndarray:
        """Return the outputs (runs, n, m) for parameters (runs, p) of those names, the same at each call.

        They are nan for a set of parameters that cannot be run; `failure` says why.
        """
        vectors = list(dict.fromkeys(split_index(name)[0] for name in self.measured.outputs))
        self.runs += len(table)
        self.failure = ""
        if self._plan is None and self._has_plan:
            try:
                self._plan = EnginePlan.of(self.scene, names, [], vectors)
            except SceneError:  # what the engine cannot run, the master can
                self._has_plan = False
        if self._plan is None:
            return np.array([self._one(names, row) for row in table])
        rows, failures, _ = run_plan(self._plan, table, threads=self.threads)
        self.failure = next((text for text in failures if text), "")
        columns = []
        for name in self.measured.outputs:
            base, index = split_index(name)
            column = self._plan.outputs[base].start + self._offset(base, index)
            columns.append([np.interp(self.measured.times, self._plan.times, row) for row in rows[:, :, column]])
        return np.moveaxis(np.array(columns), 0, -1)

    def _offset(self, base: str, index: tuple[int, ...]) -> int:
        """Return the position of an element in its vector."""
        member, _, vector = base.partition(".")
        if not index:
            return 0
        return self.scene.member(member).archive.arrays[vector].indices.index(index)

    def _one(self, names: Sequence[str], row: np.ndarray) -> np.ndarray:
        values = {name: self._whole(name, value) for name, value in zip(names, row, strict=True)}
        try:
            result = run_table(changed(self.scene, values, origin="identification"))
        except (SubsystemError, CouplingError) as error:
            self.failure = str(error)
            return np.full(self.measured.values.shape, np.nan)
        times, columns = result["time"].to_numpy(), []
        for name in self.measured.outputs:
            base, index = split_index(name)
            array = result[base].to_numpy().reshape(times.size, -1)
            columns.append(np.interp(self.measured.times, times, array[:, self._offset(base, index)]))
        return np.array(columns).T

    def _whole(self, name: str, value: float) -> float | list[float]:
        member, _, parameter = name.partition(".")
        elements = self.scene.member(member).archive.vectors.get(parameter)
        return [float(value)] * len(elements) if elements else float(value)
