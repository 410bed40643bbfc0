"""The interface vector of a loop: the torn outputs, and their time derivatives where these are unknown too."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .extrapolation import Fit, Sample, taylor_weights
from .node import Node

__all__ = ["InterfaceVector", "TornOutputs"]


class TornOutputs(NamedTuple):
    """Outputs of one node that feed torn connections.

    Attributes
    ----------
    node : Node
        Their source.
    columns : ndarray of int, shape (m,)
        Indices of the node's outputs.
    nominals : ndarray, shape (m,)
        Nominal values of these outputs.
    """

    node: Node
    columns: np.ndarray
    nominals: np.ndarray


class InterfaceVector:
    """Layout of the unknowns x (n,): per node its torn values and, where asked for, its rates times a length [s].

    Parameters
    ----------
    outputs : sequence of TornOutputs
        One for each source of torn connections, in the order of a sweep.
    with_rates : sequence of bool
        Whether the rates of that node's outputs are unknowns as well.
    """

    def __init__(self, outputs: Sequence[TornOutputs], with_rates: Sequence[bool]) -> None:
        self.outputs = tuple(outputs)
        self.scale = np.concatenate(
            [np.tile(torn.nominals, 2 if rates else 1) for torn, rates in zip(outputs, with_rates, strict=True)] + [[]]
        )  # (n,) nominals of the unknowns
        self._layout: list[tuple[Node, np.ndarray, slice, slice | None]] = []
        first = 0
        for torn, rates in zip(outputs, with_rates, strict=True):
            middle = first + torn.columns.size
            last = middle + torn.columns.size if rates else middle
            self._layout.append((torn.node, torn.columns, slice(first, middle), slice(middle, last) if rates else None))
            first = last
        self.size = first

    def pack(self, sample: Callable[[Node], Sample], length: float) -> np.ndarray:
        """Return the unknowns (n,) in the samples of their nodes; rates are multiplied by length [s]."""
        parts = []
        for node, columns, _, slopes in self._layout:
            _, values, rates = sample(node)
            parts.append(values[columns])
            if slopes is not None and rates is not None:
                parts.append(length * rates[columns])
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def unpack(
        self, x: np.ndarray, sample: Callable[[Node], Sample], time: float, length: float
    ) -> Mapping[Node, Sample]:
        """Return the samples at `time` [s] with the unknowns x (n,) in them; other outputs are those of `sample`."""
        guesses = {}
        for node, columns, where, slopes in self._layout:
            base = sample(node)
            values, rates = base.values.copy(), None
            values[columns] = x[where]
            if slopes is not None and base.rates is not None:
                rates = base.rates.copy()
                rates[columns] = x[slopes] / length
            guesses[node] = Sample(time, values, rates)
        return guesses

    def predict(self, fit: Fit, time: float, length: float) -> np.ndarray:
        """Return the unknowns (n,) at the end of a step from the polynomials through their past samples."""
        parts, ahead = [], taylor_weights(length)
        for node, columns, _, slopes in self._layout:
            c = fit(node.samples, time)[:, columns]
            parts.append(ahead.dot(c))
            if slopes is not None:
                parts.append(length * (ahead[:3] @ c[1:]))
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def seeds(self) -> Mapping[Node, np.ndarray]:
        """Return the derivatives (n_y, n) of every node's outputs by the unknowns' values, for the chain rule."""
        seeds = {}
        for node, columns, where, _ in self._layout:
            seeds[node] = np.zeros((len(node.subsystem.outputs), self.size))
            seeds[node][columns, np.arange(where.start, where.stop)] = 1.0
        return seeds
