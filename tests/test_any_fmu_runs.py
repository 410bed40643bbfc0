"""Scenes of small foreign FMUs: ends, times, warnings and errors of a run."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmu_maker import real
from tca_cosim import results
from tca_cosim.cli import app
from tca_cosim.errors import FmuWarning
from tca_cosim.verification import reference
from tca_cosim.verification.monolith.integration import solve_monolith
from typer.testing import CliRunner

# -- start, end, warnings ----------------------------------------------------------------------------------------------

ENDING = """
if (t + h > {end} + 1e-9) {{
  m->reached = {reached};
  m->terminated = 1;
  LOG(fmi2Discard, "the model ends");
  return fmi2Discard;
}}
real[0] = t + h;
"""


@pytest.mark.parametrize("state", [True, False])
@pytest.mark.parametrize("end", [0.45, 0.5, 0.01])
def test_an_fmu_may_end_the_simulation(make: Callable, scene: Callable, state: bool, end: float) -> None:
    """Where it could go no further it says when it ended: within a step, at its begin, in the first one."""
    fmu = make(
        "a", [real("y"), real("t")], step=ENDING.format(end=end, reached=end), output="real[1] = t;", state=state
    )
    result = tca.run(scene({"a": fmu}, step=0.1))
    assert result.attrs["status"] == "complete"
    assert float(result["time"][-1]) == pytest.approx(end, abs=1e-12)
    assert f"a ended the simulation at t = {end:g} s: the model ends" in result.attrs["ended"]
    inner = np.arange(0.0, end, 0.1)
    np.testing.assert_allclose(result["time"][: inner.size], inner, atol=1e-12)


def test_an_fmu_may_end_at_the_end_of_a_step(make: Callable, scene: Callable) -> None:
    end = "m->reached = t + h; m->time = t + h; m->terminated = 1; return fmi2Discard;"
    step = f"real[0] = t + h; if (t + h > 0.45) {{ {end} }}"
    result = tca.run(scene({"a": make("a", [real("y")], step=step)}, step=0.1))
    assert result.attrs["status"] == "complete"
    assert result["a.y"].values[-1] == pytest.approx(0.5)
    assert "a ended the simulation at t = 0.5 s" in result.attrs["ended"]


@pytest.mark.parametrize("state", [True, False])
def test_the_other_fmus_end_at_the_same_time(make: Callable, scene: Callable, state: bool) -> None:
    other = make("b", [real("u", "input", start=0.0), real("y")], output="real[1] = t;", state=state)
    fmu = make("a", [real("y")], step=ENDING.format(end=0.45, reached=0.45), state=state)
    result = tca.run(scene({"b": other, "a": fmu}, "a.y -> b.u", step=0.1))
    assert result.attrs["status"] == "complete"
    assert float(result["time"][-1]) == pytest.approx(0.45 if state else 0.4)
    assert result["b.y"][-1] == result["time"][-1]


def test_start_time_stop_time_and_tolerance_are_handed_over(make: Callable, scene: Callable) -> None:
    output = "real[0] = m->start_time; real[1] = m->stop_time; real[2] = m->tolerance; real[3] = t;"
    fmu = make("e", [real("a"), real("b"), real("c"), real("now")], output=output)
    result = tca.run(scene({"e": fmu}, stop=3.0, start_time=2.0, tolerance=1e-5))
    assert [float(result[f"e.{name}"][0]) for name in "abc"] == [2.0, 3.0, 1e-5]
    assert result["time"].values.tolist() == [2.0, 2.25, 2.5, 2.75, 3.0]
    assert result["e.now"].values.tolist() == result["time"].values.tolist()
    for solve in (solve_monolith, reference.run):
        with pytest.raises(tca.SceneError, match=r"start_time = 0.5 s: the (monolith|reference) starts at 0 s; remove"):
            solve(tca.read("step", {"stop_time": 1.0, "start_time": 0.5}))
    with pytest.raises(tca.SceneError, match=r"start_time = 4.0: not before the stop time, 3 s"):
        scene({"e": fmu}, stop=3.0, start_time=4.0)


def test_warnings_are_shown_once_each(make: Callable, scene: Callable) -> None:
    step = 'LOG(fmi2Warning, "tolerance not reached in step %d", m->steps); return fmi2Warning;'
    with pytest.warns(FmuWarning, match=r"w: tolerance not reached in step 0 \(at t = 0 s, 4 times in all\)") as caught:
        result = tca.run(scene({"w": make("w", [real("y")], step=step)}))
    assert len(caught) == 1
    [warning] = json.loads(result.attrs["warnings"])
    assert (warning["member"], warning["count"], warning["time"]) == ("w", 4, 0.0)


def test_the_command_line_shows_warnings_and_who_ended_the_run(
    make: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    step = 'LOG(fmi2Warning, "careful in step %d", m->steps); ' + ENDING.format(end=0.45, reached=0.45)
    make("w", [real("y")], step=step)
    (tmp_path / "s.toml").write_text("stop_time = 1\nconnections = []\n[fmus]\nw = 'w.fmu'\n")
    shown = CliRunner().invoke(app, ["run", "s.toml"]).output
    assert shown.count("warning: ") == 1
    assert re.search(r"warning: w: careful in step 0 \(at t = 0 s, \d+ times in all\)", shown)
    assert "w ended the simulation at t = 0.45 s: careful in step 5; the model ends" in shown


@pytest.mark.slow
@pytest.mark.parametrize(
    "locale", [{"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, {"PYTHONIOENCODING": "ascii"}]
)
def test_files_of_any_name_in_any_locale(make: Callable, tmp_path: Path, locale: dict[str, str]) -> None:
    make("mödel", [real("y")], output="real[0] = t;")
    text = 'title = "Täst"\nstop_time = 1\nconnections = []\n[fmus]\na = "mödel.fmu"\n'
    (tmp_path / "scène.toml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-c", "from tca_cosim.cli import app; app()", "run", "scène.toml", "--out", "rés ült"]
    done = subprocess.run(command, cwd=tmp_path, env={**os.environ, **locale}, capture_output=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert results.read(tmp_path / "rés ült" / "scène.nc")["a.y"][-1] == 1.0


def test_results_that_are_not_finite_are_named(make: Callable, scene: Callable) -> None:
    fmu = make("n", [real("y"), real("z")], output="real[1] = t > 0.3 ? 0.0 / 0.0 : 1.0;")
    with pytest.warns(FmuWarning, match=r"a: z is -?nan \(at t = 0.5 s, 3 times in all\)"):
        tca.run(scene({"a": fmu}))
    other = make("d", [real("u", "input", start=0.0)])
    with pytest.raises(tca.CouplingError, match=r"a: output z is -?nan at t = 0.\d+ s"):
        tca.run(scene({"a": fmu, "d": other}, "a.z -> d.u"))


def test_a_run_without_warnings_is_silent(make: Callable, scene: Callable, capfd: pytest.CaptureFixture[str]) -> None:
    step = 'm->callbacks->logger(m->callbacks->componentEnvironment, NULL, fmi2OK, NULL, "all is well");'
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = tca.run(scene({"w": make("w", [real("y")], step=step)}))
    assert result.attrs["warnings"] == "[]"
    assert capfd.readouterr() == ("", "")


def test_errors_carry_all_lines_of_the_message(make: Callable, scene: Callable) -> None:
    step = 'if (t > 0.4) { LOG(fmi2Error, "first line\\nsecond line, 50%% done, value %g\\n", t); return fmi2Error; }'
    with pytest.raises(tca.CouplingError, match=r"(?s)first line.*second line, 50% done, value 0.5") as caught:
        tca.run(scene({"w": make("w", [real("y")], step=step)}, coupling={"halvings": 1}))
    assert caught.value.partial.sizes["time"] >= 3
