"""The interface vector of a loop: the torn outputs, and their time derivatives where these are unknown too."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .extrapolation import Fit, Sample, taylor_weights
from .node import Node

__all__ = ["InterfaceVector", "TornOutputs"]


GROWTH = 10.0  # ratio of a size to its nominal up to which the nominal stays, since secants are in units of nominals
SMALL = 1e-3  # least nominal, as a share of the largest value of a loop in the same unit
TINY = 1e-9  # the same of the largest value of all units


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
        self.adaptive = np.concatenate(
            [
                np.tile([not torn.node.subsystem.outputs[k].has_nominal for k in torn.columns], 2 if rates else 1)
                for torn, rates in zip(outputs, with_rates, strict=True)
            ]
            + [np.zeros(0, dtype=bool)]
        ).astype(bool)  # (n,) unknowns whose nominal is not declared
        self._sizes = np.zeros(self.scale.size)  # (n,) largest values seen of these
        self._layout: list[tuple[Node, np.ndarray, slice, slice | None]] = []
        first = 0
        for torn, rates in zip(outputs, with_rates, strict=True):
            middle = first + torn.columns.size
            last = middle + torn.columns.size if rates else middle
            self._layout.append((torn.node, torn.columns, slice(first, middle), slice(middle, last) if rates else None))
            first = last
        self.size = first
        units = [
            torn.node.subsystem.outputs[k].unit
            for torn, rates in zip(outputs, with_rates, strict=True)
            for _ in range(2 if rates else 1)
            for k in torn.columns
        ]
        self._units = np.array(units, dtype=object)
        self.fits_nominals = bool(self.adaptive.any())
        self.with_rates = any(with_rates)
        self._adapted = self._provisional = self._settled = False  # settled: adapt() was the last to fit nominals
        self._unseen = np.zeros(self.size, dtype=bool)  # (n,) unknowns that were zero when nominals were fitted

    def adapt(self, values: np.ndarray) -> bool:
        """Fit undeclared nominals to accepted values (n,) of the unknowns; True where they change.

        A nominal is the largest size seen so far, at least SMALL of the largest in the same unit and TINY of the
        largest at all: what stays below is noise of the others. Such a value, as the force of a contact that has not
        set in, tells no size, so its nominal is the largest in its unit until it grows.
        """
        if not self.fits_nominals:
            return False
        before, self._sizes = self._sizes, _larger(self._sizes, values)
        if self._settled and (self._sizes == before).all():  # as in most steps
            return False
        self._settled = True
        wanted, unseen = self._fitted(self._sizes)
        if unseen[self.adaptive].all():
            return False
        doubtful = self._unseen | self._provisional
        keeps = bool((wanted <= GROWTH * self.scale).all() and (GROWTH * wanted >= self.scale)[doubtful].all())
        keeps = keeps and self._adapted
        self._adapted, self._provisional = True, False
        if not keeps:
            self.scale, self._unseen = wanted, unseen
        return not keeps

    def adapt_provisionally(self, values: np.ndarray) -> bool:
        """Fit undeclared nominals to the values (n,) of a first sweep that are too large for them, until adapt()."""
        if not self.fits_nominals:
            return False
        sizes = _larger(self._sizes, values)
        if self._settled and (sizes == self._sizes).all():
            return False
        wanted, unseen = self._fitted(sizes)
        if unseen[self.adaptive].all() or (self._adapted and (wanted <= GROWTH * self.scale).all()):
            return False
        self.scale, self._unseen, self._adapted, self._provisional, self._settled = wanted, unseen, True, True, False
        return True

    def _fitted(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return nominals (n,) for sizes (n,) of the unknowns, and (n,) whether these are too small to tell one."""
        sizes = sizes.copy()
        for _, _, where, slopes in self._layout:  # a value and its rate times the length are of one size
            if slopes is not None:
                sizes[where] = sizes[slopes] = np.maximum(sizes[where], sizes[slopes])
        largest = sizes[self.adaptive].max()
        unseen = sizes <= TINY * largest
        floors = np.full(self.size, TINY * largest)
        for unit in set(self._units[self.adaptive]):
            alike = self._units == unit
            share = np.where(unseen[alike], 1.0, SMALL if unit != "1" else 0.0)
            floors[alike] = np.maximum(floors[alike], share * sizes[alike].max())
        return np.where(self.adaptive, np.maximum(sizes, floors), self.scale), unseen

    def name(self, k: int) -> str:
        """Return the output behind the unknown k, for messages: 'rod.delta', or its rate."""
        for node, columns, values, slopes in self._layout:
            for where, kind in ((values, ""), (slopes, ", rate")):
                if where is not None and where.start <= k < where.stop:
                    port = node.subsystem.outputs[columns[k - where.start]]
                    return f"{node.subsystem.name}.{port.name}{kind}"
        raise IndexError(k)

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


def _larger(sizes: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the sizes (n,), or those of the values (n,) where they are larger and finite."""
    larger: np.ndarray = np.maximum(sizes, np.where(np.isfinite(values), np.abs(values), 0.0))
    return larger
