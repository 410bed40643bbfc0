"""Inputs that are allowed, and probably not meant: each is warned of, by what to write instead."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import pytest
import tca_cosim as tca

ROD = {"stop_time": 1.0, "fmus": {"rod": "rod.fmu"}, "connections": [], "coupling": {"macro_step": 0.5}}
HEATS = {"lower": "thermal.fmu", "upper": "thermal.fmu", "rod": "rod.fmu"}


def sums(text: str) -> dict[str, Any]:
    return {"stop_time": 1.0, "fmus": HEATS, "connections": [text]}


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (
            {**ROD, "rod": {"closure": "exchanged"}},
            "connect rod.delta -> rod.delta_guess, or set rod.closure = 'inside'",
        ),
        ({**ROD, "rod": {"tca.azimuth": [0, 90, 180]}}, "14.3 turns; write '90 deg' if meant"),
        ({**ROD, "rod": {"tca.azimuth[1]": "90"}}, "write '90 deg' if meant"),
        ({**ROD, "rod": {"tip_body.inertia": [1e-8, 0, 0]}}, "no body has these"),
        ({**ROD, "rod": {"T[1]": {"steps": [[5.0, 300.0], [6.0, 310.0]]}}}, "lie outside of the run, 0 to 1 s"),
        (
            {**ROD, "start_time": 0.5, "rod": {"T[1]": {"ramps": [[0.0, 300.0], [0.5, 310.0]]}}},
            "rod.T[1]: its times, 0 to 0.5 s, lie outside of the run, 0.5 to 1 s, so that it is constant",
        ),
        (sums("lower.T + upper.T -> rod.T"), "the weights of temperatures sum to 2; a mean has 1"),
        (sums("lower.T - upper.T -> rod.T"), "the weights of temperatures sum to 0; a mean has 1"),
    ],
)
def test_doubtful_scenes_are_warned_of(scene: dict[str, Any], words: str) -> None:
    with pytest.warns(tca.SceneWarning) as given:
        tca.read(scene)
    assert any(words in str(one.message) for one in given)


@pytest.mark.parametrize(
    "scene",
    [
        {**ROD, "rod": {"closure": "exchanged", "delta_guess": 0.0}},
        {**ROD, "connections": ["rod.delta -> rod.delta_guess"], "rod": {"closure": "exchanged"}},
        {**ROD, "rod": {"tca.azimuth": ["0 deg", "400 deg", 6.28]}},
        {**ROD, "rod": {"tip_body.inertia": [1e-8, 2e-8, 3e-8]}},
        sums("0.3333*lower.T + 0.6667*upper.T -> rod.T"),
        *tca.titles(),
    ],
)
def test_scenes_that_are_meant_are_not(scene: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", tca.SceneWarning)
        tca.read(scene)


@pytest.mark.parametrize(
    ("content", "signal", "words"),
    [
        ("t,V,V\n0,1,2\n1,3,4\n", {"file": "v.csv", "column": "V"}, "has two columns of that name; rename one"),
        ("t,V\n0,1\n", {"file": "v.csv"}, "give a file and its column"),
        ("t,V\n0,1\n", {"file": "v.csv", "columns": "V"}, "not a signal"),
    ],
)
def test_columns_are_named_without_doubt(content: str, signal: Any, words: str, tmp_path: Path) -> None:
    (tmp_path / "v.csv").write_text(content)
    (tmp_path / "s.toml").write_text('stop_time = "1 s"\n')
    if "file" in signal:
        signal = {**signal, "file": str(tmp_path / "v.csv")}
    with pytest.raises(tca.SceneError, match=words):
        tca.read(tmp_path / "s.toml", {"thermal.V": signal})


def test_python_files_that_exit_make_no_fmu(tmp_path: Path) -> None:
    (tmp_path / "ends.py").write_text("import sys\nsys.exit(3)\n")
    with pytest.raises(tca.SceneError, match="PythonFMU makes no FMU of it: SystemExit: 3"):
        tca.read({"stop_time": 1.0, "fmus": {"g": str(tmp_path / "ends.py")}, "connections": []})
