"""Our side of the comparison with CoFmuPy, which is not needed here: what it is asked, what is made of its answers."""

from __future__ import annotations

import ast
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from pythonfmu import FmuBuilder
from tca_cosim.benchmarks.peers import cofmupy
from tca_cosim.benchmarks.peers.cofmupy import (
    HERE,
    LOOP,
    OURS,
    THEIRS,
    CofmupyRow,
    comparison_table,
    job,
    parse,
    rate,
    run_ours,
)

DELTA = [("rod", f"delta[{k}]") for k in (1, 2, 3)]


@pytest.fixture
def gain(tmp_path: Path) -> str:
    return str(FmuBuilder.build_FMU(HERE / "loop_gain.py", tmp_path, canGetAndSetFMUstate=True))


def stand_in(tmp_path: Path, script: str) -> Path:
    """Something that is run where CoFmuPy's Python would be."""
    path = tmp_path / "python"
    path.write_text(f"#!{sys.executable}\n{script}")
    path.chmod(0o755)
    return path


def test_a_scene_becomes_their_job() -> None:
    asked = job(tca.read("step", [f"connections={cofmupy.WIRES}", "coupling.macro_step=0.5"]), DELTA)
    thermal, rod = asked["fmus"]
    assert (thermal["id"], rod["id"], asked["step"], asked["steps"]) == ("thermal", "rod", 0.5, 60)
    assert [thermal["reals"][f"V[{k}]"] for k in (1, 2, 3)] == [0.0, 1.5, 3.0]
    assert rod["reals"]["T[1]"] == 298.15  # they would start from 0 K
    assert (rod["integers"]["closure"], rod["booleans"]["dynamic"]) == (2, False)
    assert rod["outputs"] == ["delta[1]", "delta[2]", "delta[3]"]
    assert ["rod", "delta[1]", "rod", "delta_guess[1]"] in asked["connections"]
    assert len(asked["connections"]) == 9
    json.dumps(asked)
    with pytest.raises(tca.SceneError, match=r"thermal.V\[1\] varies in time"):
        job(tca.read("sine"), DELTA)


@pytest.mark.parametrize("gain_of_loop", [0.5, 2.25])
def test_our_master_solves_the_loop_on_either_side_of_1(gain: str, gain_of_loop: float, tmp_path: Path) -> None:
    file = tmp_path / "loop.toml"
    file.write_text(LOOP.format(path=gain, gain=gain_of_loop))
    answer = run_ours(tca.read(file), [("one", "y")])
    verdict, error = rate(answer, np.full((10, 1), 1.0 / (1.0 + gain_of_loop)))
    assert (verdict, answer.failure, answer.watched.shape) == ("converges", "", (10, 1))
    assert error < 1e-6
    assert answer.cpu > 0.0


def test_their_answer_is_the_last_line(gain: str, tmp_path: Path) -> None:
    file = tmp_path / "loop.toml"
    file.write_text(LOOP.format(path=gain, gain=0.5))
    said = {"version": "9", "failure": "", "times": [0.1], "watched": [[0.75], [0.5]], "cpu": 0.25}
    fake = stand_in(
        tmp_path,
        "import sys\nopen('asked', 'w').write(sys.stdin.read())\nprint('hello')\n" + f"print({json.dumps(said)!r})",
    )
    answer = cofmupy.run_theirs(fake, tca.read(file), [("one", "y")], tmp_path)
    np.testing.assert_array_equal(answer.watched, [[0.75], [0.5]])
    assert (answer.failure, answer.cpu) == ("", 0.25)
    asked = json.loads((tmp_path / "asked").read_text())
    assert asked["connections"] == [["one", "y", "two", "u"], ["two", "y", "one", "u"]]
    for nothing in ("", "hello"):
        with pytest.raises(tca.CosimError, match="gave no answer"):
            parse(nothing)


def test_a_python_without_it_is_named_with_the_remedy(tmp_path: Path) -> None:
    lacking = stand_in(tmp_path, "raise ModuleNotFoundError(\"No module named 'cofmupy'\")")
    with pytest.raises(tca.CosimError, match=r"No module named 'cofmupy'; give a Python .*pip install cofmupy"):
        cofmupy._ask(lacking, {}, tmp_path)
    with pytest.raises(tca.CosimError, match="nowhere"):
        cofmupy._ask(tmp_path / "nowhere", {}, tmp_path)


def test_verdicts_and_ratios() -> None:
    reference = np.full((3, 1), 2.0)
    made = cofmupy.MasterRun
    assert rate(made("", np.array([[2.0], [1.0], [2.0]]), 1.0), reference) == ("converges", 0.5)
    assert rate(made("", np.array([[2.0], [9.0], [2.0]]), 1.0), reference)[0] == "says nothing, and diverges"
    assert rate(made("", np.full((3, 1), np.nan), 1.0), reference)[0] == "says nothing, and diverges"
    verdict, error = rate(made("no\nmore", np.array([[2.0]]), 1.0), reference)
    assert (verdict, error) == ("ends at step 2 of 3: no", math.inf)
    rows = [
        CofmupyRow("a", 0.5, OURS, 1.0, "converges", 1e-3, 2.0),
        CofmupyRow("a", 0.5, OURS, 0.1, "converges", 1e-6, 8.0),
        CofmupyRow("a", 0.5, THEIRS, 0.1, "converges", 1e-2, 3.0),
        CofmupyRow("a", 0.5, THEIRS, 0.01, "converges", 1e-5, 16.0),
        CofmupyRow("a", 2.0, THEIRS, 0.01, "says nothing, and diverges", 1e9, 16.0),
        CofmupyRow("b", 0.5, THEIRS, 0.01, "converges", 1e-5, 16.0),
    ]
    ratio, same = (list(column.cells) for column in comparison_table(rows).columns[-2:])
    assert ratio == ["-", "-", "1.5", "2", "-", "-"]
    assert same == ["-", "-", "0.38", "-", "-", "-"]


def test_their_side_stands_alone() -> None:
    """It runs where this package is not installed."""
    for name in ("cofmupy_side.py", "loop_gain.py"):
        tree = ast.parse((HERE / name).read_text())
        actual = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        assert actual
        assert all(node.level == 0 and not node.module.startswith("tca_cosim") for node in actual)
