"""Comparison of the master with CoFmuPy's (rollback, Gauss-Seidel, plain fixed point) on the same FMUs and wiring.

    python -m tca_cosim.benchmarks.peers.cofmupy --python /where/CoFmuPy/is/installed/bin/python

CoFmuPy needs an environment of its own (pip install cofmupy), where cofmupy_side.py runs. Theory: plain iteration
multiplies an error by the loop gain in every sweep, so it converges only below 1. Errors are the largest of all macro
steps, against b/(1 + g) and against the rod that closes the loop inside.
"""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from ...cosim.signals import Constant
from ...errors import CosimError, SceneError
from ...scene import Scene, read
from ...simulation import open_simulation, recorded_variables
from ...simulation import run as run_scene

__all__ = [
    "OURS",
    "THEIRS",
    "CofmupyRow",
    "MasterRun",
    "comparison_table",
    "job",
    "parse",
    "rate",
    "run_ours",
    "run_theirs",
]

OURS, THEIRS = "tca-cosim", "CoFmuPy"
HERE = Path(__file__).parent
STEPS = (1.0, 0.1, 0.01)  # s
LOOP = """stop_time = "1 s"
connections = ["one.y -> two.u", "two.y -> one.u"]
fmus = {{ one = "{path}", two = "{path}" }}
[one]
a = 1.0
g = {gain}
[two]
g = -1.0
[coupling]
exchange = "held"
waveform = "held"
"""
# The last connection changes nothing (beta = 0), but CoFmuPy iterates only where a loop has two FMUs.
WIRES = '["thermal.T -> rod.T", "rod.delta -> rod.delta_guess", "rod.delta -> thermal.delta"]'


@dataclass(frozen=True)
class MasterRun:
    """A run of one of the masters.

    failure: its message, empty where it reached the end; watched: (n, variables) at the ends of the macro steps
    done.
    """

    failure: str
    watched: np.ndarray
    cpu: float  # [s] of the macro steps, without loading


@dataclass(frozen=True)
class CofmupyRow:
    """One line of the comparison."""

    case: str
    gain: float  # of the loop, by theory
    code: str
    step: float  # [s]
    verdict: str
    error: float  # share of the largest value
    cpu: float  # [s]


def job(scene: Scene, watch: Sequence[tuple[str, str]]) -> dict[str, Any]:
    """A scene as cofmupy_side.py takes it. Raises SceneError where an input is not constant."""
    sections = {"Real": "reals", "Integer": "integers", "Enumeration": "integers", "Boolean": "booleans"}
    fmus = []
    for member in scene.members:
        values: dict[str, Any] = {"reals": {}, "integers": {}, "booleans": {}}
        for name, variable in member.archive.variables.items():
            value = member.parameters.get(name, variable.start if variable.causality == "input" else None)
            if signal := member.signals.get(name):
                if not isinstance(signal, Constant):
                    raise SceneError(f"{scene.name}: {member.name}.{name} varies in time; give a constant")
                value = signal.value
            if value is not None:
                values[sections[variable.type]][name] = value
        wanted = [c.source for c in scene.connections] + list(watch)
        outputs = list(dict.fromkeys(variable for name, variable in wanted if name == member.name))
        fmus.append({"id": member.name, "path": str(member.archive.path), **values, "outputs": outputs})
    step = scene.coupling.macro_step
    return {
        "fmus": fmus,
        "connections": [[*c.source, *c.target] for c in scene.connections],
        "step": step,
        "steps": round(scene.stop_time / step),
        "watch": [list(end) for end in watch],
    }


def parse(stdout: str) -> dict[str, Any]:
    """The answer on the last line of its output. Raises CosimError where there is none."""
    try:
        return json.loads(stdout.splitlines()[-1])
    except (IndexError, json.JSONDecodeError) as error:
        raise CosimError(f"CoFmuPy's side gave no answer but {stdout[-300:]!r}") from error


def run_ours(scene: Scene, watch: Sequence[tuple[str, str]]) -> MasterRun:
    """Run a scene with this package's master; watch: (member, variable) to compare."""
    watched, failure = [], ""
    with open_simulation(scene) as ready:
        columns = [_column(scene, *end) for end in watch]
        begin = time.process_time()
        try:
            watched = [[log.record[name][k] for name, k in columns] for log in ready.steps()]
        except CosimError as error:
            failure = str(error)
        spent = time.process_time() - begin
    return MasterRun(failure, np.array(watched).reshape(-1, len(watch)), spent)


def rate(answer: MasterRun, reference: np.ndarray) -> tuple[str, float]:
    """Verdict in words, and the largest error as a share of the reference's largest value."""
    done = len(answer.watched)
    error = np.abs(answer.watched - reference[:done]).max(initial=0.0) / np.abs(reference).max()
    if answer.failure:
        return f"ends at step {done + 1} of {len(reference)}: {answer.failure.splitlines()[0][:60]}", math.inf
    if not error < 1.0:
        return "says nothing, and diverges", float(error)
    return "converges", float(error)


def comparison_table(rows: Sequence[CofmupyRow]) -> Table:
    """The comparison as a table for the terminal."""
    table = Table("case", "gain", "code", "H \\[s]", "what it does", "error", "CPU \\[ms]", "ratio", "same H")
    for row in rows:
        best = [r for r in rows if (r.case, r.gain, r.code) == (row.case, row.gain, OURS) and r.error <= row.error]
        equal = [r for r in best if r.step == row.step]
        compared = row.verdict == "converges" and row.code != OURS
        ratios = [f"{row.cpu / min(r.cpu for r in b):.2g}" if compared and b else "-" for b in (best, equal)]
        numbers = (f"{row.error:.2g}", f"{1e3 * row.cpu:.3g}", *ratios)
        table.add_row(row.case, f"{row.gain:g}", row.code, f"{row.step:g}", row.verdict, *numbers)
    return table


def _column(scene: Scene, member: str, variable: str) -> tuple[str, int]:
    return member, [v.name for v in recorded_variables(scene.member(member))].index(variable)


def _ask(python: Path, what: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Run cofmupy_side.py as text, so that the modules beside it are not imported by its Python."""
    command = [str(python), "-c", (HERE / "cofmupy_side.py").read_text()]
    try:
        done = subprocess.run(
            command, input=json.dumps(what), capture_output=True, text=True, timeout=600, cwd=folder, check=True
        )
    except subprocess.CalledProcessError as error:
        said = (error.stderr.splitlines() or ["nothing"])[-1]
        raise CosimError(f"{python}: {said}; give a Python that has CoFmuPy (pip install cofmupy)") from error
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CosimError(f"{python}: {error}") from error
    return parse(done.stdout)


def run_theirs(python: Path, scene: Scene, watch: Sequence[tuple[str, str]], folder: Path) -> MasterRun:
    """Run a scene with CoFmuPy under another Python."""
    answer = _ask(python, job(scene, watch), folder)
    return MasterRun(answer["failure"], np.array(answer["watched"]).reshape(-1, len(watch)), answer["cpu"])


def _cases(path: str, folder: Path) -> list[tuple[str, float, Scene, list[tuple[str, str]], np.ndarray]]:
    """The cases: title, gain, scene, variables that are compared, reference."""
    cases = []
    for gain in (0.5, 2.25):
        file = folder / f"loop-{gain}.toml"
        file.write_text(LOOP.format(path=path, gain=gain))
        scene = read(file)
        cases.append(("two gains in a loop", gain, scene, [("one", "y")], np.full((10, 1), 1.0 / (1.0 + gain))))
    for title, gain, softer in (("TCAs of 10 N/m", 0.4, ["parameters=measured"]), ("scene step", 3.2, [])):
        for step in STEPS:
            settings = [*softer, f"coupling.macro_step={step}"]
            delta = run_scene(read("step", [*settings, "rod.closure=inside"]))["rod.delta"].to_numpy()[1:]
            watch = [("rod", f"delta[{k + 1}]") for k in range(delta.shape[1])]
            cases.append((title, gain, read("step", [*settings, f"connections={WIRES}"]), watch, delta))
    return cases


def main(
    python: Annotated[Path, typer.Option(help="The Python of the environment that has CoFmuPy")],
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each; the median time counts")] = 3,
) -> None:
    """Compares CoFmuPy with our master: where plain iteration fails, and the CPU time at equal error."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        built = _ask(python, {"build": {"source": str(HERE / "loop_gain.py"), "folder": name}}, folder)
        for case, gain, scene, watch, reference in _cases(built["path"], folder):
            runs = {
                OURS: [run_ours(scene, watch) for _ in range(repeats)],
                THEIRS: [run_theirs(python, scene, watch, folder) for _ in range(repeats)],
            }
            for code, answers in runs.items():
                verdict, error = rate(answers[0], reference)
                spent = statistics.median(answer.cpu for answer in answers)
                rows.append(CofmupyRow(case, gain, code, scene.coupling.macro_step, verdict, error, spent))
    out = Console()
    out.print(comparison_table(rows))
    out.print(
        f"{THEIRS} {built['version']}, gauss_seidel, iterative; its tolerance (absolute 1e-3) and 10 sweeps fixed.\n"
        "Error: at the ends of a code's own macro steps, share of the largest value. Ratio: CPU time to that of our\n"
        "fastest row of the case with no larger error, and to that with the same macro step."
    )


if __name__ == "__main__":
    try:
        typer.run(main)
    except CosimError as error:
        raise SystemExit(f"error: {error}") from None
