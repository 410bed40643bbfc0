"""Mutants of Python modules, each run against the tests that execute its line; by hand, before a release.

    python -m pytest -p no:xdist --cov --cov-context=test --cov-report= tests/test_master.py ...    # writes .coverage
    python tests/mutants.py cosim scene --seed 1 --count 200 --out mutants.jsonl

Each mutant changes one comparison, operator, constant, condition, return, call or assignment in a copy of the package.
A fork that has imported the libraries runs its tests until one fails. Mutants that survive are looked at one by one:
each gets a test that shows the right value, or the reason why it is equivalent (docs/reliability.md). An interrupted
run goes on where it stopped.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import json
import os
import random
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from coverage.numbits import numbits_to_nums

ROOT = Path(__file__).parents[1]
LIBRARIES = (
    "numpy",
    "scipy.optimize",
    "scipy.integrate",
    "xarray",
    "netCDF4",
    "fmpy",
    "lxml.etree",
    "hypothesis",
    "pint",
)
SWAPPED = {
    pair[way]: pair[1 - way]
    for pair in (
        (ast.Lt, ast.LtE),
        (ast.Gt, ast.GtE),
        (ast.Eq, ast.NotEq),
        (ast.In, ast.NotIn),
        (ast.Is, ast.IsNot),
        (ast.Add, ast.Sub),
        (ast.Mult, ast.Div),
        (ast.And, ast.Or),
    )
    for way in (0, 1)
} | {ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult}
OPPOSITE = {"min": "max", "max": "min", "any": "all", "all": "any"}
MOST_TESTS, LIMIT = 40, 60  # of one mutant: tests, and seconds of each


def left_out(tree: ast.Module) -> set[ast.AST]:
    """Annotations, docstrings, exported names and the words of messages."""
    skipped: set[ast.AST] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            parts = [node.value]
        elif isinstance(node, (ast.AnnAssign, ast.arg)):
            parts = [node.annotation]
        elif isinstance(node, ast.FunctionDef):
            parts = [node.returns]
        elif isinstance(node, (ast.Raise, ast.JoinedStr)) or (
            isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
        ):
            parts = [node]
        for part in parts:
            skipped.update(ast.walk(part) if part else ())
    return skipped


def replacements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what may stand in place of a node."""

    def changed(**fields: object) -> ast.AST:
        kept = {name: getattr(node, name) for name in node._fields}
        return ast.copy_location(type(node)(**{**kept, **fields}), node)

    if isinstance(node, ast.Compare):
        for k, operator in enumerate(node.ops):
            if type(operator) in SWAPPED:
                yield changed(ops=[*node.ops[:k], SWAPPED[type(operator)](), *node.ops[k + 1 :]])
    elif isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)) and type(node.op) in SWAPPED:
        yield changed(op=SWAPPED[type(node.op)]())
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub)):
        yield node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, (bool, int, float)):
        value = node.value
        yield changed(
            value=not value if isinstance(value, bool) else value + 1 if isinstance(value, int) else 2.0 * value or 1.0
        )
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in OPPOSITE:
        yield changed(func=ast.Name(OPPOSITE[node.func.id], ast.Load()))
    elif isinstance(node, ast.If):
        yield from (changed(test=ast.Constant(value)) for value in (True, False))
    elif isinstance(node, ast.IfExp):
        yield changed(body=node.orelse, orelse=node.body)
    elif isinstance(node, ast.Return) and node.value is not None and not isinstance(node.value, ast.Constant):
        yield changed(value=ast.Constant(None))
    elif (
        isinstance(node, (ast.Break, ast.Continue))
        or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call))
        or (isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute))
    ):
        yield ast.copy_location(ast.Pass(), node)


class Swap(ast.NodeTransformer):
    """Puts `new` in place of one node."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def mutants(source: str) -> Iterator[tuple[int, str, str, str]]:
    """Yield (line, text before, text after, module) of every mutant of a module."""
    tree = ast.parse(source)
    skipped = left_out(tree)
    count = sum(len(list(replacements(node))) for node in ast.walk(tree) if node not in skipped)
    for number in range(count):
        fresh = ast.parse(source)
        skipped = left_out(fresh)
        sites = ((node, new) for node in ast.walk(fresh) if node not in skipped for new in replacements(node))
        node, new = next(pair for k, pair in enumerate(sites) if k == number)
        before, after = (ast.unparse(ast.fix_missing_locations(each)).split("\n")[0] for each in (node, new))
        yield node.lineno, before, after, ast.unparse(ast.fix_missing_locations(Swap(node, new).visit(fresh)))


def covering_tests(database: Path, package: Path) -> dict[tuple[str, int], set[str]]:
    """Return (module, line) -> names of the tests that execute it; line 0: any line of the module."""
    covering: dict[tuple[str, int], set[str]] = {}
    query = (
        "select path, context, numbits from line_bits "
        "join file on file.id = file_id join context on context.id = context_id"
    )
    for path, context, bits in sqlite3.connect(database).execute(query):
        where = Path(path).resolve()
        if context and where.is_relative_to(package):
            for line in (0, *numbits_to_nums(bits)):
                covering.setdefault((where.relative_to(package).as_posix(), line), set()).add(context.split("|")[0])
    return covering


def verdict(tests: list[str], log: Path) -> str:
    """Run tests in a fork until one fails; it ends after the time that all of them may take."""
    child = os.fork()
    if child == 0:
        os.setsid()
        with log.open("w") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        options = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-W", "ignore", f"--timeout={LIMIT}"]
        os._exit(int(pytest.main([*options, *tests])))
    end = time.monotonic() + 5 * LIMIT
    while time.monotonic() < end:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return "survived" if status == 0 else "killed"
        time.sleep(0.05)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "killed"


def run(folders: list[str], seed: int, count: int, out: Path, covering: Mapping[tuple[str, int], set[str]]) -> None:
    """Run a sample of the mutants of some folders of the package; append one line of JSON each."""
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        for entry in ROOT.iterdir():
            if entry.name != "orchestration":
                (work / entry.name).symlink_to(entry)
        copy = shutil.copytree(ROOT / "orchestration", work / "tca_cosim", ignore=shutil.ignore_patterns("__pycache__"))
        (work / "orchestration").symlink_to(copy)
        os.chdir(work)
        os.environ |= {"PYTHONPATH": str(work), "PYTHONDONTWRITEBYTECODE": "1"}
        sys.path.insert(0, str(work))
        sys.dont_write_bytecode = True
        for library in LIBRARIES:
            importlib.import_module(library)
        files = sorted(path for folder in folders for path in (copy / folder).rglob("*.py"))
        sample = [(path, *mutant) for path in files for mutant in mutants(path.read_text())]
        random.Random(seed).shuffle(sample)
        done = len(out.read_text().splitlines()) if out.exists() else 0
        for path, line, before, after, module in sample[done:count]:
            key = path.relative_to(copy).as_posix()
            tests = sorted(covering.get((key, line)) or covering.get((key, 0), ()))[:MOST_TESTS]
            original = path.read_text()
            path.write_text(module)
            status = verdict(tests, work / "log") if tests else "uncovered"
            path.write_text(original)
            with out.open("a") as file:
                file.write(
                    json.dumps({"where": f"{key}:{line}", "before": before, "after": after, "status": status}) + "\n"
                )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folders", nargs="+", help="folders of orchestration/, such as cosim scene")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    parser.add_argument("--coverage", type=Path, default=Path(".coverage"), help="database with a context per test")
    given = parser.parse_args()
    package = (ROOT / "orchestration").resolve()
    run(given.folders, given.seed, given.count, given.out.resolve(), covering_tests(given.coverage, package))
    outcomes = [json.loads(line) for line in given.out.resolve().read_text().splitlines()]
    for outcome in outcomes:
        if outcome["status"] != "killed":
            print(f"{outcome['status']}: {outcome['where']}: {outcome['before']} -> {outcome['after']}")
    print(f"{sum(o['status'] == 'killed' for o in outcomes)} of {len(outcomes)} mutants killed")
