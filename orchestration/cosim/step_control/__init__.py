"""How long a macro step is. A control is a small frozen value with take(master, t, h) -> Taken: it tries a step of
length h and says what was accepted and which length it would take next. Master.StepError passes through; the driver
halves and retries."""

from __future__ import annotations

from .doubling import Doubling
from .embedded import Embedded
from .fixed import Fixed
from .taken import Control, Taken

__all__ = ["Control", "Doubling", "Embedded", "Fixed", "Taken"]
