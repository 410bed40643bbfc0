"""Mutants of Python modules, each run against the tests that execute its line; by hand, before a release.

    python tests/mutation map --out build/mutation/all tests                  # which test executes which line, once
    python tests/mutation run cosim scene --count 400 --out build/mutation/seed1.jsonl
    python tests/mutation run cosim scene --count 400 --out build/mutation/seed1.jsonl --again   # those not caught

A mutant is caught where a test fails or hangs. Those that survive are looked at one by one: each gets a test that shows
the right value, or the reason why it is equivalent (docs/reliability.md). An interrupted run goes on where it stopped.
"""

from __future__ import annotations

import argparse
import compileall
import importlib
import json
import os
import py_compile
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from line_map import LineMap, measure
from trials import Trials, sample

ROOT = Path(__file__).parents[2]
MAPS = ROOT / "build" / "mutation"
LIBRARIES = (
    "numpy",
    "scipy.optimize",
    "scipy.integrate",
    "xarray",
    "netCDF4",
    "fmpy",
    "lxml.etree",
    "hypothesis",
    "matplotlib.pyplot",
    "networkx",
    "pint",
    "typer.testing",
)


@contextmanager
def copied_project() -> Iterator[Path]:
    """Copy the package into a project whose other parts are links; yields the copy. Tests run there and import it."""
    with tempfile.TemporaryDirectory() as name:
        work = Path(name).resolve()
        for entry in ROOT.iterdir():
            if entry.name != "orchestration":
                (work / entry.name).symlink_to(entry)
        copy = shutil.copytree(ROOT / "orchestration", work / "tca_cosim", ignore=shutil.ignore_patterns("__pycache__"))
        compileall.compile_dir(copy, quiet=1, invalidation_mode=py_compile.PycInvalidationMode.CHECKED_HASH)
        (work / "orchestration").symlink_to(copy)
        os.chdir(work)
        os.environ |= {"PYTHONPATH": str(work), "PYTHONDONTWRITEBYTECODE": "1"}
        sys.path.insert(0, str(work))
        sys.dont_write_bytecode = True
        yield copy


def report(out: Path) -> None:
    """Print the mutants that no test caught, and the share of those caught."""
    outcomes = [json.loads(line) for line in out.read_text().splitlines()]
    caught = [outcome for outcome in outcomes if outcome["status"] in ("killed", "hung")]
    for outcome in sorted(outcomes, key=lambda each: (each["module"], each["line"])):
        if outcome not in caught:
            print("{status}: {module}:{line}: {before} -> {after}".format(**outcome))
    print(f"{len(caught)} of {len(outcomes)} mutants caught: {100 * len(caught) / len(outcomes):.1f} %")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    commands = parser.add_subparsers(dest="command", required=True)
    mapping = commands.add_parser("map", help="measure which test executes which line")
    mapping.add_argument("tests", nargs="+", help="files or names of tests")
    mapping.add_argument("--marks", default="not hosts", help="marks of the tests, as pytest takes them")
    mapping.add_argument("--out", type=Path, required=True, help=f"measurement, in {MAPS.relative_to(ROOT)}/")
    running = commands.add_parser("run", help="run a sample of mutants")
    running.add_argument("folders", nargs="+", help="folders or files of orchestration/, such as cosim scene")
    running.add_argument("--seed", type=int, default=1)
    running.add_argument("--count", type=int, default=400)
    running.add_argument("--budget", type=float, default=10.0, help="seconds of tests per mutant, shortest first")
    running.add_argument("--out", type=Path, required=True)
    running.add_argument("--again", action="store_true", help="run again those that were not caught")
    given = parser.parse_args()
    out = given.out.resolve()
    out.parent.mkdir(parents=True, exist_ok=True)
    with copied_project() as copy:
        if given.command == "map":
            measure(given.tests, given.marks, copy, out)
            return
        for library in LIBRARIES:
            importlib.import_module(library)
        mutants = sample(copy, given.folders, given.seed, given.count)
        if given.again:
            lines = out.read_text().splitlines()
            out.write_text("".join(f"{line}\n" for line in lines if json.loads(line)["status"] in ("killed", "hung")))
        trials = Trials(copy, copy.parent / "scratch", mutants, LineMap.read(MAPS), out, given.budget)
        trials.run_inside()
        trials.run_outside()
    report(out)


if __name__ == "__main__":
    main()
