"""A subsystem whose wired inputs come in other units, scaled, or as sums: value = sum of factor * source + offset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from .subsystem import Port, Recorder
from .topology import Connection

__all__ = ["convert_inputs"]


def convert_inputs(subsystem: Recorder, connections: Sequence[Connection]) -> Recorder:
    """Return the subsystem as seen from its sources.

    connections: those that feed it. An input that a sum feeds has one port for each term. Limits and nominals of wired
    inputs are given in the source's unit; everything else of the subsystem stays as it is.
    """
    kind = _SummedInputs if any(c.terms > 1 for c in connections) else _ConvertedInputs
    return cast(Recorder, kind(subsystem, connections))


class _ConvertedInputs:
    def __init__(self, subsystem: Recorder, connections: Sequence[Connection]) -> None:
        self._subsystem = subsystem
        transformations = {c.target[1]: (c.factor, c.offset) for c in connections}
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


class _SummedInputs:
    """Ports are the terms of all inputs; the weights (ports, inputs) say what they add to which input."""

    def __init__(self, subsystem: Recorder, connections: Sequence[Connection]) -> None:
        self._subsystem = subsystem
        ports: list[Port] = []
        entries: list[tuple[int, float]] = []  # of every port: column of its input, factor
        self._offsets = np.zeros(len(subsystem.inputs))
        for column, port in enumerate(subsystem.inputs):
            terms = sorted((c for c in connections if c.target[1] == port.name), key=lambda c: c.term)
            self._offsets[column] = sum(c.offset for c in terms)
            if len(terms) < 2:
                pair = (terms[0].factor, terms[0].offset) if terms else (1.0, 0.0)
                ports.append(_seen(port, *pair))
                entries.append((column, pair[0]))
                continue
            whole = sum(c.factor for c in terms)
            start = (port.start - self._offsets[column]) / whole if whole else 0.0
            for c in terms:  # a term alone has no limits
                nominal = port.nominal / abs(c.factor)
                ports.append(replace(port, name=c.port, nominal=nominal, start=start, least=-np.inf, most=np.inf))
                entries.append((column, c.factor))
        self.inputs = tuple(ports)
        self._columns = np.array([column for column, _ in entries], dtype=int)
        self._factors = np.array([factor for _, factor in entries])
        self._weights = np.zeros((len(ports), len(subsystem.inputs)))
        self._weights[np.arange(len(ports)), self._columns] = self._factors
        self._polynomials = np.zeros((4, len(subsystem.inputs)))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._subsystem, name)

    def initialise(self, time: float, values: np.ndarray) -> np.ndarray:
        return self._subsystem.initialise(time, values @ self._weights + self._offsets)

    def set_inputs(self, polynomials: np.ndarray) -> None:
        np.matmul(polynomials, self._weights, out=self._polynomials)
        self._polynomials[0] += self._offsets
        self._subsystem.set_inputs(self._polynomials)

    def tangent(self, columns: np.ndarray) -> np.ndarray | None:
        inputs, back = np.unique(self._columns[columns], return_inverse=True)
        tangent = self._subsystem.tangent(inputs)
        return None if tangent is None else tangent[:, back] * self._factors[columns]


def _seen(port: Port, factor: float, offset: float) -> Port:
    """The port in the unit of its source."""
    if (factor, offset) == (1.0, 0.0):
        return port
    ends = sorted(((port.least - offset) / factor, (port.most - offset) / factor))
    return replace(
        port, nominal=port.nominal / abs(factor), start=(port.start - offset) / factor, least=ends[0], most=ends[1]
    )
