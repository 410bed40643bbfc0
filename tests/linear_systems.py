"""Linear systems that count calls or refuse some, and what drives them."""

from __future__ import annotations

import math

from tca_cosim import SubsystemError
from tca_cosim.cosim.linear_subsystem import Linear
from tca_cosim.studies.stability.model_problems import linear


class Wrapped:
    """A linear system that counts what is asked of it and refuses steps longer than `longest`."""

    def __init__(self, inner: Linear, longest: float = math.inf, partial: bool = False) -> None:
        self.inner, self.longest, self.partial = inner, longest, partial
        self.saves = self.restores = self.tries = 0
        self.handles: set[int] = set()

    def __getattr__(self, name: str) -> object:
        return getattr(self.inner, name)

    def step(self, time: float, length: float) -> None:
        self.tries += 1
        if length > self.longest:
            reached = None
            if self.partial:
                self.inner.step(time, self.longest)
                reached = time + self.longest
            raise SubsystemError(f"{self.inner.name}: longer than {self.longest}", reached)
        self.inner.step(time, length)

    def save(self, into: object = None) -> object:
        self.saves += 1
        state = self.inner.save()
        if into is None:
            into = [None]
            self.handles.add(id(into))
        into[0] = state
        return into

    def restore(self, state: list) -> None:
        self.restores += 1
        self.inner.restore(state[0])

    def free(self, state: list) -> None:
        self.handles.remove(id(state))


def driven(signal: object) -> dict:
    return {"integrator": {"u": signal}}


def integrator() -> Linear:
    return linear("integrator", [0], [1], [1], [0], [0], "u", "y")
