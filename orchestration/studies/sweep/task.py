"""One run of a sweep, to be done in any process that sees the scene's files."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ... import scene, simulation
from ...errors import CosimError
from ...fmi.archive import cached_archive

__all__ = ["Outcome", "Point"]


@dataclass(frozen=True)
class Outcome:
    """series: (times, columns of all outputs), None where the run failed; failure: why, '' where it did not."""

    point: tuple[str, ...]
    series: np.ndarray | None
    failure: str = ""


@dataclass(frozen=True)
class Point:
    """What is set in this run beyond `held`; called, it runs."""

    source: str
    held: tuple[str, ...]
    point: tuple[str, ...]
    outputs: tuple[str, ...]
    times: np.ndarray

    def lost(self, why: str) -> Outcome:
        return Outcome(self.point, None, why)

    def __call__(self) -> Outcome:
        try:
            result = simulation.run(scene.read(self.source, (*self.held, *self.point), cached_archive))
        except CosimError as error:
            return Outcome(self.point, None, str(error))
        ran = result["time"].to_numpy()
        columns = np.concatenate([result[name].to_numpy().reshape(ran.size, -1) for name in self.outputs], axis=1)
        return Outcome(self.point, np.stack([np.interp(self.times, ran, column) for column in columns.T], axis=1))
