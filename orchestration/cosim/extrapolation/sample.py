"""One instant of a subsystem's wired outputs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

__all__ = ["NOTHING", "Sample"]


class Sample(NamedTuple):
    time: float  # [s]
    values: np.ndarray  # (n,)
    rates: np.ndarray | None  # (n,) time derivatives, None where not offered or not asked for


NOTHING = Sample(math.nan, np.empty(0), None)  # before there is one
