"""Verification of coupled systems whose verdict is known: healthy, step too long, diverging, hidden error."""

from __future__ import annotations

import html.parser
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from coupled_systems import (
    diverging_explicit,
    diverging_iteration,
    failing_part,
    healthy_chain,
    healthy_circuit,
    healthy_loop,
    healthy_until_its_end,
    healthy_with_one_step_length,
    healthy_with_unused_rates,
    healthy_without_states,
    hidden_counter,
    hidden_held_inputs,
    hidden_noise,
    hidden_other_model,
    hidden_rates,
    hidden_rollback,
    long_chain,
    long_circuit,
    long_dahlquist,
)
from tca_cosim.cli import app
from tca_cosim.verification import coupling
from tca_cosim.verification.coupling.convergence import assess_signal
from typer.testing import CliRunner

SYSTEMS: list[tuple[Callable[[Path], Path], str, str]] = [
    (healthy_circuit, "healthy", "agrees with it"),
    (healthy_chain, "healthy", "no loops"),
    (healthy_without_states, "healthy", "agrees with it"),
    (healthy_loop, "healthy", "one - two"),
    (long_circuit, "step too long", "take coupling.macro_step ="),
    (long_chain, "step too long", "filter.x: error about"),
    (long_dahlquist, "step too long", "one.x"),
    (diverging_iteration, "diverging", "so that an error grows from sweep to sweep"),
    (diverging_explicit, "diverging", "loop gain 4, so that an error grows"),
    (hidden_rollback, "hidden error", "two: rollback: a restored state steps on differently"),
    (healthy_with_unused_rates, "healthy", "(not used in this scene)"),
    (healthy_with_one_step_length, "healthy", "agrees with it"),
    (healthy_until_its_end, "healthy", "no loops"),
    (failing_part, "failing", "two: "),
    (hidden_rates, "hidden error", "two: rates: the derivative of x is off by 2e+02 %"),
    (hidden_counter, "hidden error", "two: step size: the result depends on the number of steps"),
    (hidden_noise, "hidden error", "two: determinism: the same calls give other results"),
    (hidden_other_model, "hidden error", "from the monolith"),
    (hidden_held_inputs, "hidden error", "two: input derivatives: are ignored"),
]


@pytest.mark.parametrize(("build", "verdict", "said"), SYSTEMS, ids=[build.__name__ for build, *_ in SYSTEMS])
def test_the_verdict_is_the_known_one(build: Callable[[Path], Path], verdict: str, said: str, tmp_path: Path) -> None:
    actual = coupling.verify(tca.read(build(tmp_path)))
    assert (actual.verdict, actual.trusted) == (verdict, verdict == "healthy"), actual.reasons
    assert said in "\n".join(actual.reasons), actual.reasons
    json.dumps(coupling.as_json(actual), allow_nan=False)
    coupling.write_html(actual, tmp_path / "page.html")
    checker = html.parser.HTMLParser()
    checker.feed((tmp_path / "page.html").read_text(encoding="utf-8"))


@pytest.mark.parametrize("order", [1, 2, 4])
def test_errors_are_estimated_by_the_observed_order(order: int) -> None:
    """y + c H^p, of which everything is known."""
    t = np.linspace(0.0, 1.0, 11)
    courses = [t + 0.3 * (0.5**k * 0.5) ** order * t**2 for k in range(3)]
    actual = assess_signal("one.x", "m", courses, 0.5, 0.001)
    exact = 0.3 * 0.5**order * float(np.sqrt(np.mean(t**4)))
    assert actual.order == pytest.approx(order, abs=1e-6)
    assert actual.error == pytest.approx(exact / float(np.ptp(courses[-1])), rel=1e-6)
    assert actual.kind == "step"
    allowed = assess_signal("one.x", "m", courses, 0.5, 1.1 * exact)
    assert allowed.kind == "settled"
    assert np.isnan(allowed.needed)


def test_counts_and_constants_are_not_judged() -> None:
    assert (
        assess_signal("a.n", "1", [np.arange(5.0), 2.0 * np.arange(5.0), 4.0 * np.arange(5.0)], 0.1, 0.01).kind
        == "count"
    )
    assert assess_signal("a.c", "1", [np.full(5, 3.25)] * 3, 0.1, 0.01).kind == "constant"
    assert assess_signal("a.y", "1", [np.linspace(0, k, 5) + 0.1 for k in (1, 2, 4)], 0.1, 0.01).kind == "unsettled"


def test_differences_that_appear_vanish_or_are_not_finite() -> None:
    t = np.linspace(0.0, 1.0, 5)
    wild = np.array([0.0, 1.0, 1e200, np.inf, np.nan])
    for courses, kind in (
        ([t, t, 1.5 * t], "unsettled"),
        ([1.5 * t, t, t], "step"),
        ([t, t, t], "settled"),
        ([wild, t, t], "step"),
        ([t, t, wild], "unsettled"),
        ([t, t, t + 1e-9 * t**2], "settled"),
        ([t, 1.5 * t], "unsettled"),
        ([t], "unknown"),
    ):
        actual = assess_signal("a.y", "m", courses, 0.1, 0.01)
        assert actual.kind == kind, (courses, actual.text)


def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    healthy_circuit(tmp_path)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["verify", "system.toml"])
    assert done.exit_code == 0, done.output
    assert "verdict: healthy" in done.output
    record = json.loads((tmp_path / "results" / "system.verify.json").read_text(encoding="utf-8"))
    assert record["trusted"] is True
    assert [run["steps"] for run in record["runs"]] == [80, 160, 320]
    assert (tmp_path / "results" / "system.verify.html").is_file()
    done = CliRunner().invoke(app, ["verify", "system.toml", "--set", "coupling.macro_step=0.8"])
    assert done.exit_code == 1, done.output
    assert "verdict: step too long" in done.output
    done = CliRunner().invoke(app, ["verify", "missing.toml"])
    assert done.exit_code == 2
