"""Logs of many macro steps as arrays, so that a run needs no object for each of its steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from .master import StepLog

__all__ = ["StepBlock", "StepLogs"]


@dataclass(frozen=True, eq=False)
class StepBlock(Sequence[StepLog]):
    """Logs of steps that were taken in one call.

    Attributes
    ----------
    columns : dict of str to ndarray, shape (steps,)
        Values of the fields `time`, `step`, `sweeps`, `residual` and `error` of StepLog.
    inverses : ndarray, shape (steps, n, n), or sequence of ndarray or None
        Values of its field `inverse`.
    rows : ndarray, shape (steps, n)
        Recorded numbers of all subsystems that move.
    places : dict of str to slice
        Name of each of these -> its columns of `rows`.
    frozen : dict of str to ndarray
        Records of the subsystems that stay as they are.
    names : tuple of str
        Names of all subsystems in the order of a record.
    """

    columns: Mapping[str, np.ndarray]
    inverses: np.ndarray | Sequence[np.ndarray | None]
    rows: np.ndarray
    places: Mapping[str, slice]
    frozen: Mapping[str, np.ndarray]
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.rows)

    @overload
    def __getitem__(self, index: int) -> StepLog: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[StepLog]: ...
    def __getitem__(self, index: int | slice) -> StepLog | Sequence[StepLog]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        c, row = self.columns, self.rows[index]
        record = {name: self.frozen[name] if name in self.frozen else row[self.places[name]] for name in self.names}
        return StepLog(
            float(c["time"][index]),
            float(c["step"][index]),
            int(c["sweeps"][index]),
            float(c["residual"][index]),
            float(c["error"][index]),
            self.inverses[index],
            record,
        )

    def record(self, name: str) -> np.ndarray:
        """Return the rows (steps, n) of a subsystem."""
        if name in self.frozen:
            return np.broadcast_to(self.frozen[name], (len(self), self.frozen[name].size))
        return self.rows[:, self.places[name]]


class StepLogs(Sequence[StepLog]):
    """Logs of a run, step by step or block by block."""

    def __init__(self, parts: Iterable[Sequence[StepLog]] = ()) -> None:
        self._parts: list[Sequence[StepLog]] = []
        self._ends: list[int] = []  # number of steps up to the end of each part
        for part in parts:
            self.add(part)

    @classmethod
    def of(cls, logs: Sequence[StepLog]) -> StepLogs:
        """Return the logs of a sequence."""
        return logs if isinstance(logs, cls) else cls([logs])

    def add(self, part: Sequence[StepLog]) -> None:
        """Append the steps that come next."""
        if not len(part):
            return
        if isinstance(part, StepBlock):
            self._parts.append(part)
            self._ends.append(len(self) + len(part))
        elif self._parts and isinstance(self._parts[-1], list):
            self._parts[-1].extend(part)
            self._ends[-1] += len(part)
        else:
            self._parts.append(list(part))
            self._ends.append(len(self) + len(part))

    def __len__(self) -> int:
        return self._ends[-1] if self._ends else 0

    def __iter__(self) -> Iterator[StepLog]:
        for part in self._parts:
            yield from part

    @overload
    def __getitem__(self, index: int) -> StepLog: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[StepLog]: ...
    def __getitem__(self, index: int | slice) -> StepLog | Sequence[StepLog]:
        if isinstance(index, slice):
            return list(self)[index]
        number = range(len(self))[index]
        k = int(np.searchsorted(self._ends, number, side="right"))
        return self._parts[k][number - self._ends[k]]

    def column(self, field: str) -> np.ndarray:
        """Return the values (steps,) of one of the numeric fields."""
        return self._joined(lambda block: block.columns[field], lambda log: getattr(log, field), np.zeros(0))

    def record(self, name: str, first: np.ndarray) -> np.ndarray:
        """Return the rows (1 + steps, n) of a subsystem: `first` (n,) at the start, then those of the steps."""
        return self._joined(lambda block: block.record(name), lambda log: log.record[name], np.atleast_2d(first))

    def inverses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers (k,) of the steps whose field `inverse` is known, and these matrices (k, n, n)."""
        numbers: list[np.ndarray] = []
        known: list[np.ndarray] = []
        for part, end in zip(self._parts, self._ends, strict=True):
            begin = end - len(part)
            inverses = part.inverses if isinstance(part, StepBlock) else [log.inverse for log in part]
            if isinstance(inverses, np.ndarray):
                numbers.append(np.arange(begin, end))
                known.append(inverses)
                continue
            chosen = [k for k, inverse in enumerate(inverses) if inverse is not None]
            if chosen:
                numbers.append(begin + np.array(chosen))
                known.append(np.array([inverses[k] for k in chosen]))
        if not known:
            return np.zeros(0, dtype=int), np.zeros((0, 0, 0))
        return np.concatenate(numbers), np.concatenate(known)

    def _joined(
        self, of_block: Callable[[StepBlock], np.ndarray], of_log: Callable[[StepLog], Any], first: np.ndarray
    ) -> np.ndarray:
        parts = [
            of_block(part) if isinstance(part, StepBlock) else np.array([of_log(log) for log in part])
            for part in self._parts
        ]
        return np.concatenate([first, *parts]) if parts else first
