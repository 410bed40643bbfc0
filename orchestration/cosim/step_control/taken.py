"""What a step control gives back."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from ..master import Master, StepLog

__all__ = ["Control", "StepResult"]


class StepResult(NamedTuple):
    steps: tuple[StepLog, ...]  # accepted, in order; empty: rejected, try `following`
    following: float  # length wished for next [s]


class Control(Protocol):
    @property
    def step(self) -> float:
        """First length [s]."""

    def attempt(self, master: Master, time: float, length: float) -> StepResult: ...
