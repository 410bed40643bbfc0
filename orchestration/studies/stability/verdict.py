"""How a short run is judged.

converged: every macro step was solved and the run decays or stays; diverged: the iteration of a macro step moved away
from its solution; unstable: every step could be done, but the run grows from step to step; slow: the iteration was
still closing in when its sweeps were used up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...cosim.acceleration import spectral_radius
from ...cosim.master import StepLog
from ...errors import CouplingError

__all__ = ["KINDS", "Verdict", "alternating_growth", "failed", "mean_growth", "spectral_growth", "succeeded"]

KINDS = ("converged", "diverged", "unstable", "slow")
DELAYS = 3  # steps that a map of states and history reaches back
NOTHING = 1e-200  # below it a course has died out
ROUNDING = 1e-9  # of a growth of 1


@dataclass(frozen=True)
class Verdict:
    kind: str  # one of KINDS
    sweeps: float  # mean per macro step; of the step that failed
    gain: float  # estimated loop gain of the last step; nan where nothing is known of it
    growth: float  # factor of the run's motion per macro step; nan where it was not looked at or none was seen


def succeeded(logs: Sequence[StepLog], growth: float = math.nan) -> Verdict:
    """Of a run that came to its end."""
    inverse = logs[-1].inverse
    return Verdict(
        "unstable" if growth > 1.0 + ROUNDING else "converged",
        float(np.mean([log.sweeps for log in logs])),
        math.nan if inverse is None else float(spectral_radius(inverse)),
        growth,
    )


def failed(error: CouplingError, explicit: bool) -> Verdict:
    """Of a run that the master gave up. The second half of the residuals tells: transients are over there."""
    residuals = error.residuals
    closing = len(residuals) > 2 and residuals[-1] < residuals[len(residuals) // 2]
    kind = "unstable" if explicit else "slow" if closing else "diverged"
    return Verdict(kind, float(error.sweeps), error.gain, math.nan)


def spectral_growth(record: Sequence[np.ndarray]) -> float:
    """Spectral radius of one macro step as a linear map of states and history, seen from the course of a run, states
    (n,) per step: delay vectors of the states follow the map, whose eigenvalues a least-squares fit of it has."""
    course = np.array(record[DELAYS:]).T  # the first steps have less history
    delayed = np.vstack([course[:, k : course.shape[1] - DELAYS + k] for k in range(DELAYS)])
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
    """Per step over the whole course; for runs that die out to the tolerance of their iteration, which shows no map."""
    return float((np.linalg.norm(record[-1]) / np.linalg.norm(record[0])) ** (1.0 / (len(record) - 1)))


def alternating_growth(record: Sequence[np.ndarray]) -> float:
    """Growth per step of what changes sign from step to step in a course, as the errors of a lagging loop do: rms of
    its second differences in the last third of a run over that in the middle third. nan where they keep their sign:
    only the motion itself is left then, whose swing a short run cannot tell from growth."""
    second = np.diff(np.array(record), n=2, axis=0)
    third = len(second) // 3
    middle, last = second[-2 * third : -third], second[-third:]
    if np.sum(last[1:] * last[:-1]) >= 0.0:
        return math.nan
    return float((np.linalg.norm(last) / np.linalg.norm(middle)) ** (1.0 / third))
