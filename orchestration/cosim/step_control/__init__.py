"""How long a macro step is. A control is a small frozen value with attempt(master, t, h) -> StepResult: it tries a
step of length h and says what was accepted and which length it would take next. Master.StepError passes through; the
driver halves and retries."""

from __future__ import annotations

from .doubling import Doubling
from .embedded import Embedded
from .fixed import Fixed
from .taken import Control, StepResult

__all__ = ["Control", "Doubling", "Embedded", "Fixed", "StepResult"]
