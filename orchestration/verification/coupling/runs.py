"""Runs of a scene with macro steps of a chosen length, kept as arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...cosim.acceleration import spectral_radius
from ...errors import CosimError, CouplingError
from ...scene import Scene
from ...simulation import open_simulation

__all__ = ["CoupledRun", "run_with_step"]


@dataclass(frozen=True)
class CoupledRun:
    """A run with one length of macro steps, as far as it came.

    Parameters
    ----------
    step : float
        Macro step asked for [s].
    times : ndarray (n,)
        The start and the ends of the macro steps [s].
    records : mapping of str to ndarray (n, variables)
        Recorded variables of each member.
    shortest : float
        Shortest macro step taken [s].
    sweeps : float
        Mean sweeps per macro step.
    residual : float
        Largest residual of a loop, share of the nominals.
    gain : float
        Largest estimated loop gain; nan where none was estimated.
    failure : str
        Why it ended early; empty where it did not.
    coupling_failed : bool
        Whether it ended because the coupling failed, not an FMU.
    """

    step: float
    times: np.ndarray
    records: Mapping[str, np.ndarray]
    shortest: float = math.nan
    sweeps: float = math.nan
    residual: float = math.nan
    gain: float = math.nan
    failure: str = ""
    coupling_failed: bool = False

    @property
    def complete(self) -> bool:
        """Whether it reached the stop time."""
        return not self.failure


def run_with_step(scene: Scene, step: float, progress: Callable[[float], None] = lambda time: None) -> CoupledRun:
    """Run a scene with fixed macro steps [s]; a failure becomes part of the result."""
    chosen = replace(scene, coupling=replace(scene.coupling, macro_step=step, control="fixed"))
    rows, logs, gains, failure, coupling_failed = [], [], list[float](), "", False
    try:
        with open_simulation(chosen) as ready:
            rows.append(ready.master.observe())
            for log in ready.steps(progress):
                logs.append(log)
                rows.append(log.record)
    except CouplingError as error:
        failure, coupling_failed, gains = str(error), True, [error.gain]
    except CosimError as error:
        failure = str(error)
    except FloatingPointError as error:
        failure, coupling_failed = f"numbers out of range: {error}", True
    names = rows[0] if rows else {}
    records = {name: np.array([row[name] for row in rows]) for name in names}
    times = np.array([scene.start_time, *(log.time for log in logs)])[: len(rows)]
    gains += [float(spectral_radius(log.inverse)) for log in logs if log.inverse is not None]
    gain = max((gain for gain in gains if math.isfinite(gain)), default=math.nan)
    if not logs:
        return CoupledRun(step, times, records, gain=gain, failure=failure, coupling_failed=coupling_failed)
    return CoupledRun(
        step=step,
        times=times,
        records=records,
        shortest=min(log.step for log in logs),
        sweeps=float(np.mean([log.sweeps for log in logs])),
        residual=max(log.residual for log in logs),
        gain=gain,
        failure=failure,
        coupling_failed=coupling_failed,
    )
