"""A subsystem that is not moved: it is initialised as any other, then what it gave at the start holds and nothing
reaches it any more."""

from __future__ import annotations

import numpy as np

from .subsystem import Recorder

__all__ = ["FrozenSubsystem"]


class FrozenSubsystem:
    """Behind the protocol of subsystem.py, for an instance whose outputs stay as they are: nothing drives it, or what
    drives it does not matter. Its rates are null."""

    has_rates = can_rollback = takes_polynomials = frozen = True

    def __init__(self, instance: Recorder) -> None:
        self._instance = instance
        self.name, self.inputs, self.outputs = instance.name, instance.inputs, instance.outputs

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        return self._instance.initialise(time, values)

    def begin(self) -> None:
        self._instance.begin()
        self._values, self._record = self._instance.values(), self._instance.record()

    def set_inputs(self, polynomials: np.ndarray) -> None:
        pass

    def step(self, time: float, length: float) -> None:
        pass

    def values(self) -> np.ndarray:
        return self._values.copy()

    def rates(self) -> np.ndarray:
        return np.zeros(len(self.outputs))

    def record(self) -> np.ndarray:
        return self._record

    def tangent(self, columns: np.ndarray) -> np.ndarray:
        return np.zeros((len(self.outputs), columns.size))

    def save(self, into: object = None) -> None:
        pass

    def restore(self, state: None) -> None:
        pass

    def free(self, state: None) -> None:
        pass

    def close(self) -> None:
        self._instance.close()
