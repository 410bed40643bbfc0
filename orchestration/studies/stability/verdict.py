"""Classification of a short run.

converged: every macro step was solved and the run decays or stays; diverged: the iteration of a macro step moved away
from its solution; unstable: every step was solved, but the run grows from step to step; slow: the residual still
decreased when the sweeps were used up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...cosim.acceleration import spectral_radius
from ...cosim.master import StepLog
from ...errors import CouplingError

__all__ = [
    "KINDS",
    "Verdict",
    "alternating_growth",
    "mean_growth",
    "spectral_growth",
    "verdict_of_failure",
    "verdict_of_run",
]

KINDS = ("converged", "diverged", "unstable", "slow")
DELAYS = 3  # steps back that the map of states and history reaches (quadratic extrapolation)
NOTHING = 1e-200  # norm below which a record has died out
ROUNDING = 1e-9  # growth - 1 that is rounding


@dataclass(frozen=True)
class Verdict:
    """Class of a run and the numbers behind it."""

    kind: str  # one of KINDS
    sweeps: float  # mean per macro step; of the step that failed
    gain: float  # estimated loop gain of the last step; nan where it is unknown
    growth: float  # factor of the motion per macro step; nan where it was not measured


def verdict_of_run(logs: Sequence[StepLog], growth: float = math.nan) -> Verdict:
    """Verdict on a run that reached its stop time; growth: factor of its motion per step, if measured."""
    inverse = logs[-1].inverse
    return Verdict(
        "unstable" if growth > 1.0 + ROUNDING else "converged",
        float(np.mean([log.sweeps for log in logs])),
        math.nan if inverse is None else float(spectral_radius(inverse)),
        growth,
    )


def verdict_of_failure(error: CouplingError, explicit: bool) -> Verdict:
    """Verdict on a run that the master gave up.

    The second half of the residuals decides, where transients are over.
    """
    residuals = error.residuals
    closing = len(residuals) > 2 and residuals[-1] < residuals[len(residuals) // 2]
    kind = "unstable" if explicit else "slow" if closing else "diverged"
    return Verdict(kind, float(error.sweeps), error.gain, math.nan)


def spectral_growth(record: Sequence[np.ndarray]) -> float:
    """Spectral radius of one macro step as a linear map of states and history, identified from states (n,) per step.

    Delay vectors of the states follow the map; a least-squares fit of it has its eigenvalues.
    """
    states = np.array(record[DELAYS:]).T  # the first steps have less history
    delayed = np.vstack([states[:, k : states.shape[1] - DELAYS + k] for k in range(DELAYS)])
    size = np.linalg.norm(delayed, axis=0)
    alive = int((size > NOTHING).cumprod().sum())
    if alive < 2:
        return 0.0
    weight = 1.0 / size[: alive - 1]
    u, s, v = np.linalg.svd(delayed[:, : alive - 1] * weight, full_matrices=False)
    rank = int((s > 1e-9 * s[0]).sum())
    projected = u[:, :rank].T @ (delayed[:, 1:alive] * weight) @ v[:rank].T / s[:rank]
    return float(np.abs(np.linalg.eigvals(projected)).max())


def mean_growth(record: Sequence[np.ndarray]) -> float:
    """Mean growth per step over the whole record; for runs that decay to the tolerance of their iteration."""
    return float((np.linalg.norm(record[-1]) / np.linalg.norm(record[0])) ** (1.0 / (len(record) - 1)))


def alternating_growth(record: Sequence[np.ndarray]) -> float:
    """Growth per step of the part of a record that alternates from step to step, as errors of explicit coupling do.

    The rms of second differences in the last third of the run over that in the middle third. nan where they keep their
    sign: then only the motion itself is left, whose oscillation a short run cannot tell from growth.
    """
    second = np.diff(np.array(record), n=2, axis=0)
    third = len(second) // 3
    middle, last = second[-2 * third : -third], second[-third:]
    if np.sum(last[1:] * last[:-1]) >= 0.0:
        return math.nan
    return float((np.linalg.norm(last) / np.linalg.norm(middle)) ** (1.0 / third))
