"""Which tests execute a line, and how long each takes: measured once for all tests that are not slower than a limit."""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import coverage
import pytest
from coverage.numbits import numbits_to_nums

__all__ = ["LineMap", "measure"]

SLOWEST = 120  # [s] of a test; slower ones take no part


@dataclass
class LineMap:
    """Tests by what they execute. seconds: of CPU, for each test that passes; lines: (module, line) -> tests."""

    seconds: dict[str, float] = field(default_factory=dict)
    lines: dict[tuple[str, int], set[str]] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> LineMap:
        """Join the measurements of a folder; the newest of each test counts."""
        joined = cls()
        newest: dict[str, Path] = {}
        for path in sorted(folder.glob("*.json"), key=lambda each: each.stat().st_mtime):
            for test, seconds in json.loads(path.read_text()).items():
                joined.seconds[test] = seconds
                newest[test] = path.with_suffix(".sqlite")
        for database in set(newest.values()):
            query = (
                "select path, context, numbits from line_bits "
                "join file on file.id = file_id join context on context.id = context_id"
            )
            for where, test, bits in sqlite3.connect(database).execute(query):
                if newest.get(test) == database:
                    module = where.rpartition("/tca_cosim/")[2]
                    for line in numbits_to_nums(bits):
                        joined.lines.setdefault((module, line), set()).add(test)
        return joined

    def tests(self, module: str, first: int, last: int) -> list[str]:
        """Return the tests that execute some lines of a module, shortest first.

        Lines that only run at import (no test executes them): all tests that execute any line of the module, or all
        there are where a module is nothing but declarations.
        """
        covering = set().union(*(self.lines.get((module, line), set()) for line in range(first, last + 1)))
        if not covering:
            covering = set().union(*(tests for (name, _), tests in self.lines.items() if name == module))
        covering = covering or set(self.seconds)
        return sorted(covering, key=lambda test: (self.seconds[test], test))


class _Recorder:
    def __init__(self, recorded: coverage.Coverage) -> None:
        self.coverage = recorded
        self.seconds: dict[str, float] = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        failed = item.session.testsfailed
        self.coverage.switch_context(item.nodeid)
        start = sum(os.times()[:4])
        result = yield
        if item.session.testsfailed == failed:
            self.seconds[item.nodeid] = round(sum(os.times()[:4]) - start, 4)
        self.coverage.switch_context("")
        return result


def measure(tests: list[str], marks: str, package: Path, out: Path) -> None:
    """Run the tests with some marks: OUT.sqlite gets what they execute of the package, OUT.json their CPU times."""
    database = out.with_suffix(".sqlite")
    database.unlink(missing_ok=True)
    recorded = coverage.Coverage(data_file=str(database), source=[str(package)], config_file=False)
    recorder = _Recorder(recorded)
    recorded.start()
    options = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", marks, f"--timeout={SLOWEST}"]
    pytest.main([*options, *tests], plugins=[recorder])
    recorded.stop()
    recorded.save()
    out.with_suffix(".json").write_text(json.dumps(recorder.seconds, indent=0))
