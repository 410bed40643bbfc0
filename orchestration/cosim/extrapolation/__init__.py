"""How a quantity known at some instants travels over a macro step: the polynomial through its newest samples.

Every method is one function fit(samples, t) -> (4, n), rows c0..c3 of u(t+s) = c0 + c1 s + c2 s^2/2 + c3 s^3/6. The
samples are oldest first; where the newest lies at the end of the step the polynomial interpolates, else it
extrapolates. With too few samples (at the start, after an event) the highest degree that they allow is used. order:
global order in H when every exchanged quantity travels so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import held, hermite, linear, quadratic
from .sample import NOTHING, Sample
from .taylor import powers

__all__ = ["METHODS", "NOTHING", "Exchange", "Sample", "powers"]


@dataclass(frozen=True)
class Exchange:
    """fit: as above; order: see above; rates: whether derivatives of the samples are used where they are known;
    slopes: whether they must be, so that an unknown sample has an unknown slope."""

    name: str
    fit: Callable[[tuple[Sample, ...], float], np.ndarray]
    order: int
    rates: bool = False
    slopes: bool = False


METHODS = {
    "held": Exchange("held", held.fit, order=1),
    "linear": Exchange("linear", linear.fit, order=2),
    "quadratic": Exchange("quadratic", quadratic.fit, order=3, rates=True),
    "hermite": Exchange("hermite", hermite.fit, order=4, rates=True, slopes=True),
}
