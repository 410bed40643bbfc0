"""One run of a sweep, executed in any process that sees the scene's files."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from ... import scene, simulation
from ...errors import CosimError, FmuWarning
from ...fmi.archive import cached_archive
from ..many_runs import warnings_of

__all__ = ["RunOutcome", "SweepTask", "series_at"]


@dataclass(frozen=True)
class RunOutcome:
    """Result of one run.

    overrides: what is set in this run alone; series: (times, columns of all outputs), None where the run failed;
    failure: its message, empty where it did not; warning: what FMUs warned of, empty where they did not.
    """

    overrides: tuple[str, ...]
    series: np.ndarray | None
    failure: str = ""
    warning: str = ""


def series_at(times: np.ndarray, ran: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return columns (n, m), known at the times `ran` (n,) [s], at other times, linear between them."""
    if np.array_equal(times, ran):
        return columns
    return np.stack([np.interp(times, ran, column) for column in columns.T], axis=1)


@dataclass(frozen=True)
class SweepTask:
    """A run to be done; calling it runs it.

    source: name or file of the scene; common: overrides of every run; overrides: those of this one; outputs: names of
    what is kept; times: (n,) [s] at which it is kept, linear between macro steps.
    """

    source: str
    common: tuple[str, ...]
    overrides: tuple[str, ...]
    outputs: tuple[str, ...]
    times: np.ndarray

    def lost(self, why: str) -> RunOutcome:
        """The outcome of a run whose process died."""
        return RunOutcome(self.overrides, None, why)

    def __call__(self) -> RunOutcome:
        """Run the scene; a failure becomes an outcome."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FmuWarning)  # kept in the outcome
                result = simulation.run_table(scene.read(self.source, (*self.common, *self.overrides), cached_archive))
        except CosimError as error:
            return RunOutcome(self.overrides, None, str(error))
        ran = result["time"].to_numpy()
        columns = np.concatenate([result[name].to_numpy().reshape(ran.size, -1) for name in self.outputs], axis=1)
        return RunOutcome(self.overrides, series_at(self.times, ran, columns), warning=warnings_of(result))
