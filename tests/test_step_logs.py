"""Logs of many steps: the same whether steps come one by one or in blocks."""

from __future__ import annotations

import numpy as np
from tca_cosim.cosim.master import StepLog
from tca_cosim.cosim.step_logs import StepBlock, StepLogs

ROWS = np.arange(12.0).reshape(4, 3)
FROZEN = np.array([7.0])
FIRST = {"a": np.array([-1.0, -2.0]), "still": FROZEN, "b": np.array([-3.0])}
INVERSES = [None, np.eye(2), 2.0 * np.eye(2), None]


def block(rows: slice = slice(None)) -> StepBlock:
    numbers = np.arange(1.0, 5.0)[rows]
    columns = {"time": numbers, "step": np.ones_like(numbers), "sweeps": numbers.astype(int)}
    columns |= {"residual": 0.1 * numbers, "error": 0.2 * numbers}
    places = {"a": slice(0, 2), "b": slice(2, 3)}
    return StepBlock(columns, INVERSES[rows], ROWS[rows], places, {"still": FROZEN}, ("a", "still", "b"))


def singles() -> list[StepLog]:
    return [
        StepLog(
            k + 1.0, 1.0, k + 1, 0.1 * (k + 1), 0.2 * (k + 1), INVERSES[k], {"a": r[:2], "still": FROZEN, "b": r[2:]}
        )
        for k, r in enumerate(ROWS)
    ]


def assert_same(logs: StepLogs, other: StepLogs) -> None:
    assert len(logs) == len(other)
    for field in ("time", "step", "sweeps", "residual", "error"):
        assert logs.column(field).tolist() == other.column(field).tolist(), field
    for name, first in FIRST.items():
        assert logs.record(name, first).tolist() == other.record(name, first).tolist(), name
    for one, another in zip(logs.inverses(), other.inverses(), strict=True):
        assert one.tolist() == another.tolist()


def test_blocks_and_single_steps_are_the_same() -> None:
    expected = StepLogs.of(singles())
    mixed = StepLogs([block(slice(0, 1)), singles()[1:2], singles()[2:3], block(slice(3, 4)), []])
    for logs in (StepLogs([block()]), mixed):
        assert_same(logs, expected)
        assert [log.time for log in logs] == [1.0, 2.0, 3.0, 4.0]
        assert logs[-1].record["b"].tolist() == [11.0]
        assert [log.sweeps for log in logs[1:3]] == [2, 3]
        assert logs[0].inverse is None
        assert logs[2].inverse is not None
    assert expected.record("a", FIRST["a"]).shape == (5, 2)


def test_no_steps_leave_the_start() -> None:
    logs = StepLogs()
    assert len(logs) == 0
    assert logs.column("time").size == 0
    assert logs.record("a", FIRST["a"]).tolist() == [[-1.0, -2.0]]
    assert logs.inverses()[0].size == 0
