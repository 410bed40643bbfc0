"""A subsystem whose wired inputs come in other units, or scaled: value = factor * what the source gives + offset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np

from .subsystem import Port, Recorder

__all__ = ["convert_inputs"]


def convert_inputs(subsystem: Recorder, transformations: Mapping[str, tuple[float, float]]) -> Recorder:
    """Return the subsystem as seen from its sources.

    transformations: input name to (factor, offset) of the connection that feeds it. Limits and nominals of these
    inputs are given in the source's unit; everything else of the subsystem stays as it is."""
    return cast(Recorder, _ConvertedInputs(subsystem, transformations))


class _ConvertedInputs:
    def __init__(self, subsystem: Recorder, transformations: Mapping[str, tuple[float, float]]) -> None:
        self._subsystem = subsystem
        pairs = [transformations.get(port.name, (1.0, 0.0)) for port in subsystem.inputs]
        self._factors, self._offsets = (np.array(column) for column in zip(*pairs, strict=True))
        self.inputs = tuple(_seen(port, *pair) for port, pair in zip(subsystem.inputs, pairs, strict=True))
        self._polynomials = np.zeros((4, len(pairs)))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._subsystem, name)

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        return self._subsystem.initialise(time, self._factors * values + self._offsets)

    def set_inputs(self, polynomials: np.ndarray) -> None:
        np.multiply(polynomials, self._factors, out=self._polynomials)
        self._polynomials[0] += self._offsets
        self._subsystem.set_inputs(self._polynomials)

    def tangent(self, columns: np.ndarray) -> np.ndarray | None:
        tangent = self._subsystem.tangent(columns)
        return None if tangent is None else tangent * self._factors[columns]


def _seen(port: Port, factor: float, offset: float) -> Port:
    """The port in the unit of its source."""
    if (factor, offset) == (1.0, 0.0):
        return port
    ends = sorted(((port.least - offset) / factor, (port.most - offset) / factor))
    return replace(
        port, nominal=port.nominal / abs(factor), start=(port.start - offset) / factor, least=ends[0], most=ends[1]
    )
