"""A subsystem whose outputs stay as they are at the start."""

from __future__ import annotations

import numpy as np

from .subsystem import Recorder

__all__ = ["FrozenSubsystem"]


class FrozenSubsystem:
    """An instance that is initialised but never stepped.

    For one that nothing drives, or whose inputs do not matter. Its rates are zero and its state cannot change, so no
    step, save or restore reaches the instance.
    """

    has_rates = can_rollback = takes_polynomials = frozen = True

    def __init__(self, instance: Recorder) -> None:
        self._instance = instance
        self.name, self.inputs, self.outputs = instance.name, instance.inputs, instance.outputs

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        """Return the outputs (n_y,) of the instance at the start."""
        return self._instance.initialise(time, values)

    def begin(self) -> None:
        """End initialization and keep outputs and record."""
        self._instance.begin()
        self._values, self._record = self._instance.values(), self._instance.record()

    def accepted_input_order(self, order: int) -> int:
        """Return the order: all are taken."""
        return order

    def set_inputs(self, polynomials: np.ndarray) -> None:
        """Ignore inputs."""

    def step(self, time: float, length: float) -> None:
        """Do nothing."""

    def values(self) -> np.ndarray:
        """Return the outputs (n_y,) at the start."""
        return self._values.copy()

    def rates(self) -> np.ndarray:
        """Return zeros (n_y,)."""
        return np.zeros(len(self.outputs))

    def record(self) -> np.ndarray:
        """Return the recorded variables (n,) at the start."""
        return self._record

    def tangent(self, columns: np.ndarray) -> np.ndarray:
        """Return zeros (n_y, n)."""
        return np.zeros((len(self.outputs), columns.size))

    def save(self, into: object = None) -> None:
        """Return no handle: there is no state."""

    def restore(self, state: None) -> None:
        """Do nothing."""

    def free(self, state: None) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Release the instance."""
        self._instance.close()
