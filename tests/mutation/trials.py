"""Trials of mutants: forks of a process that has collected all tests, each with one function changed.

A mutant inside of a function replaces the function's code in a fork, so that a trial starts at once. One outside of
any function (a constant, a default, a field) is tried in a fork that has imported libraries only. Either way the copy
of the package on disk is changed too, for what tests start as a program of its own.
"""

from __future__ import annotations

import ast
import contextlib
import gc
import json
import os
import random
import resource
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FunctionType

import pytest
from line_map import LineMap
from operators import Mutant, count, functions, mutate

__all__ = ["Trials", "sample"]

SLOWER = 10.0  # times what the tests took for the map, after which a mutant hangs
GRACE = 20.0  # [s] added to this limit
OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-W", "ignore")


def sample(copy: Path, folders: list[str], seed: int, number: int) -> list[tuple[Path, int]]:
    """Return a random sample of the mutants of some folders or files, as (file, number of the mutant)."""
    roots = [copy / folder for folder in folders]
    files = sorted(path for root in roots for path in ([root] if root.is_file() else root.rglob("*.py")))
    everything = [(path, k) for path in files for k in range(count(path.read_text()))]
    print(f"{len(everything)} mutants in {len(files)} files", flush=True)
    random.Random(seed).shuffle(everything)
    return everything[:number]


@dataclass
class _FailureFile:
    """Writes down the first test that fails."""

    path: Path

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.path.exists():
            self.path.write_text(report.nodeid)


@dataclass
class Trials:
    """Trials of a sample; each appends a line of JSON to `out`. budget: seconds of tests per mutant, shortest first."""

    copy: Path  # of the package
    scratch: Path
    mutants: list[tuple[Path, int]]
    map: LineMap
    out: Path
    budget: float
    sound: set[str] = field(default_factory=set)  # tests that have caught something, and pass without a mutant
    unsound: set[str] = field(default_factory=set)  # and those that fail without one, which take no part

    def done(self) -> set[tuple[str, int]]:
        """Return the mutants that have been tried."""
        lines = self.out.read_text().splitlines() if self.out.exists() else []
        return {(entry["module"], entry["number"]) for entry in map(json.loads, lines)}

    def run_inside(self) -> None:
        """Try the mutants inside of functions, in forks of a session that has collected the tests."""
        child = os.fork()
        if child == 0:
            files = sorted({test.partition("::")[0] for tests in self.map.lines.values() for test in tests})
            os._exit(int(pytest.main([*OPTIONS, *files], plugins=[self, _FailureFile(self.scratch / "failed")])))
        os.waitpid(child, 0)

    @pytest.hookimpl
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        items = {item.nodeid: item for item in session.items}
        alive: dict[tuple[str, str, int], list[FunctionType]] = {}
        for each in gc.get_objects():
            if isinstance(each, FunctionType):
                code = each.__code__
                alive.setdefault((code.co_filename, code.co_name, code.co_firstlineno), []).append(each)
        for path, mutant, tests in self._waiting():
            if mutant.function is None:
                continue
            name, line = mutant.function
            targets = alive.get((str(path), name, line), [])
            new = functions(mutant.tree, str(path)).get((name, line))
            if not targets or new is None or any(each.__code__.co_freevars != new.co_freevars for each in targets):
                continue  # tried by run_outside

            def change(targets: list[FunctionType] = targets, new: CodeType = new) -> None:
                for each in targets:
                    each.__code__ = new

            def attempt(tests: list[str]) -> bool:
                chosen = [items[test] for test in tests if test in items]
                session.config.option.basetemp = str(self.scratch / "tmp")
                for item, following in zip(chosen, [*chosen[1:], None], strict=True):
                    session.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                    if session.testsfailed:
                        return False
                return True

            self._try(path, mutant, tests, change, attempt)
        return True

    def run_outside(self) -> None:
        """Try what is left: mutants outside of functions, in forks that have imported libraries only."""

        def attempt(tests: list[str]) -> bool:
            options = [*OPTIONS, f"--basetemp={self.scratch / 'tmp'}"]
            code = pytest.main([*options, *tests], plugins=[_FailureFile(self.scratch / "failed")])
            return code in (pytest.ExitCode.OK, pytest.ExitCode.USAGE_ERROR)  # the latter: a test is no longer there

        for path, mutant, tests in self._waiting():
            self._try(path, mutant, tests, lambda: None, attempt)

    def _waiting(self) -> Iterator[tuple[Path, Mutant, list[str]]]:
        done = self.done()
        for path, number in self.mutants:
            module = path.relative_to(self.copy).as_posix()
            if (module, number) in done:
                continue
            self.current = module, number
            mutant = mutate(path.read_text(), number)
            yield path, mutant, self._chosen(module, mutant)

    def _chosen(self, module: str, mutant: Mutant) -> list[str]:
        chosen, total = [], 0.0
        for test in self.map.tests(module, mutant.line, mutant.line):
            if test in self.unsound:
                continue
            total += self.map.seconds[test]
            if chosen and total > self.budget:
                break
            chosen.append(test)
        return chosen

    def _try(
        self,
        path: Path,
        mutant: Mutant,
        tests: list[str],
        change: Callable[[], None],
        attempt: Callable[[list[str]], bool],
    ) -> None:
        start = time.monotonic()
        original = path.read_text()
        status, by = "uncovered", ""
        while tests:
            path.write_text(ast.unparse(mutant.tree))
            try:
                status, by = self._verdict(tests, change, attempt)
            finally:
                path.write_text(original)
            if not by or by in self.sound:
                break
            if self._verdict([by], lambda: None, attempt)[0] == "survived":
                self.sound.add(by)
                break
            self.unsound.add(by)
            tests = [test for test in tests if test != by]
        module, number = self.current
        entry = {
            "module": module,
            "number": number,
            "line": mutant.line,
            "before": mutant.before,
            "after": mutant.after,
            "status": status,
            "by": by,
            "tests": len(tests),
            "inside": mutant.function is not None,
            "seconds": round(time.monotonic() - start, 2),
        }
        with self.out.open("a") as file:
            file.write(json.dumps(entry) + "\n")

    def _verdict(
        self, tests: list[str], change: Callable[[], None], attempt: Callable[[list[str]], bool]
    ) -> tuple[str, str]:
        """Return what became of a change, and the test that caught it."""
        shutil.rmtree(self.scratch, ignore_errors=True)
        self.scratch.mkdir()
        limit = GRACE + SLOWER * sum(self.map.seconds[test] for test in tests)
        child = os.fork()
        if child == 0:
            os.setpgid(0, 0)  # what the tests start ends with it
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
            os.environ["TCA_COSIM_CACHE"] = str(self.scratch / "cache")
            with (self.scratch / "log").open("w") as log:
                os.dup2(log.fileno(), 1)
                os.dup2(log.fileno(), 2)
            passed = False
            with contextlib.suppress(BaseException):
                change()
                passed = attempt(tests)
            os._exit(0 if passed else 1)
        end = time.monotonic() + 3 * limit  # longer than of CPU: other programs may share the machine
        while time.monotonic() < end:
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(child, signal.SIGKILL)  # what the tests have started and left
                failed = self.scratch / "failed"
                by = failed.read_text() if failed.exists() else ""
                return "survived" if status == 0 else "hung" if os.WIFSIGNALED(status) else "killed", by
            time.sleep(0.02)
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return "hung", ""
