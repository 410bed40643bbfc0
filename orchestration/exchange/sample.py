"""One instant of a subsystem's wired outputs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

__all__ = ["Sample"]


class Sample(NamedTuple):
    time: float  # [s]
    values: np.ndarray  # (n,)
    rates: np.ndarray | None  # (n,) time derivatives, None where not offered or not asked for
