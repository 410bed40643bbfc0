"""What a step control gives back."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from ..master import Master, StepLog

__all__ = ["Control", "Taken"]


class Taken(NamedTuple):
    steps: tuple[StepLog, ...]  # accepted, in order; empty: rejected, try `following`
    following: float  # length wished for next [s]


class Control(Protocol):
    @property
    def step(self) -> float:
        """First length [s]."""

    def take(self, master: Master, time: float, length: float) -> Taken: ...
