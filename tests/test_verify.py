"""Verification of coupled systems whose verdict is known: healthy, step too long, diverging, hidden error."""

from __future__ import annotations

import html.parser
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmu_maker import make_fmu, real
from tca_cosim.cli import app
from tca_cosim.verification import coupling
from tca_cosim.verification.coupling.convergence import assess_signal
from typer.testing import CliRunner

# The input at time t of the step that began at memory[0], as a polynomial through the derivatives that were set.
COURSE = (
    "double s = t - memory[0];double u = real[0] + s * (slope[0][1] + s * (slope[0][2] / 2.0 + s * slope[0][3] / 6.0));"
)
STEP = "memory[0] = t; return integrate(m, h);"
SMOOTH = {"canInterpolateInputs": "true"}
VOLT = '<Unit name="V"><BaseUnit kg="1" m="2" s="-3" A="-1"/></Unit><Unit name="A"><BaseUnit A="1"/></Unit>'


def first_order(path: Path, rate: str, start: float, **how: object) -> Path:
    """x' = rate(u, x), output x: real[0] = u, real[1] = x, real[2] = der(x)."""
    how.setdefault("step", STEP)
    how.setdefault("co_simulation", SMOOTH)
    units = how.pop("unit", ("1", "1"))
    variables = [
        real("u", "input", start=0.0, unit=units[0]),
        real("x", "output", start=start, initial="exact", unit=units[1]),
        real("der(x)", "local"),
    ]
    return make_fmu(path, variables, output=f"{COURSE} real[2] = {rate};", states={"x": "der(x)"}, **how)


def gain(path: Path, a: str, g: float) -> Path:
    """y = a + g u, at once; a may depend on t."""
    variables = [real("u", "input", start=0.0), real("y", "output")]
    output = f"{COURSE} real[1] = {a} + {g} * u;"
    return make_fmu(path, variables, output=output, step="memory[0] = t;", co_simulation=SMOOTH)


def sine(path: Path, frequency: float) -> Path:
    """A source: y = sin(w t)."""
    return make_fmu(path, [real("y", "output")], output=f"real[0] = sin({frequency} * t);")


def scene(folder: Path, wires: list[str], names: list[str], stop: float, step: float, **settings: object) -> Path:
    given = {"exchange": "linear", "waveform": "linear", **settings, "macro_step": step}
    lines = [
        f"stop_time = {stop}",
        f"connections = {json.dumps(wires)}",
        "[fmus]",
        *(f'{name} = "{name}.fmu"' for name in names),
        "[coupling]",
        *(f"{key} = {json.dumps(value)}" for key, value in given.items()),
    ]
    file = folder / "system.toml"
    file.write_text("\n".join(lines) + "\n")
    return file


PAIR = (["one.x -> two.u", "two.x -> one.u"], ["one", "two"])
CHAIN = (["source.y -> filter.u"], ["source", "filter"])
HELD = {"exchange": "held", "waveform": "held"}
EXPLICIT = {**HELD, "method": "none"}


def circuit(folder: Path, **how: object) -> None:
    """A capacitor and an inductor with a resistor: V' = I, I' = -V - 0.4 I, here with the current's sign turned."""
    both = {"units": VOLT, "model_exchange": {}, **how}
    first_order(folder / "one.fmu", "-u", 1.0, unit=("A", "V"), **both)
    first_order(folder / "two.fmu", "u - 0.4 * real[1]", 0.0, unit=("V", "A"), **both)


def healthy_circuit(folder: Path) -> Path:
    circuit(folder)
    return scene(folder, *PAIR, 4.0, 0.05)


def healthy_chain(folder: Path) -> Path:
    sine(folder / "source.fmu", 2.0)
    first_order(folder / "filter.fmu", "u - real[1]", 0.0)
    return scene(folder, *CHAIN, 3.0, 0.05)


def healthy_without_states(folder: Path) -> Path:
    """Explicit, since nothing can be set back."""
    circuit(folder, state=False)
    return scene(folder, *PAIR, 3.0, 0.005, **EXPLICIT)


def healthy_loop(folder: Path) -> Path:
    """An algebraic loop of gain 4, iterated, with a source."""
    first_order(folder / "one.fmu", "u - real[1]", 1.0)
    gain(folder / "two.fmu", "0.2", -4.0)
    return scene(folder, ["one.x -> two.u", "two.y -> one.u"], ["one", "two"], 2.0, 0.02)


def long_circuit(folder: Path) -> Path:
    circuit(folder)
    return scene(folder, *PAIR, 4.0, 0.2, **EXPLICIT)


def long_chain(folder: Path) -> Path:
    sine(folder / "source.fmu", 6.0)
    first_order(folder / "filter.fmu", "u - real[1]", 0.0)
    return scene(folder, *CHAIN, 3.0, 0.15, **HELD)


def long_dahlquist(folder: Path) -> Path:
    """Unstable above H = ln(5/3) = 0.51."""
    first_order(folder / "one.fmu", "u - real[1]", 1.0)
    gain(folder / "two.fmu", "0.0", -4.0)
    return scene(folder, ["one.x -> two.u", "two.y -> one.u"], ["one", "two"], 6.0, 0.6, **EXPLICIT)


def diverging_iteration(folder: Path) -> Path:
    gain(folder / "one.fmu", "sin(5.0 * t)", -4.0)
    gain(folder / "two.fmu", "0.1", 1.0)
    return scene(folder, ["one.y -> two.u", "two.y -> one.u"], ["one", "two"], 0.4, 0.1, **{**HELD, "method": "plain"})


def diverging_explicit(folder: Path) -> Path:
    """A loop of gain 4 at once: explicit coupling lags by a step, so that an error grows at every step."""
    gain(folder / "one.fmu", "sin(5.0 * t)", -4.0)
    gain(folder / "two.fmu", "0.1", 1.0)
    return scene(folder, ["one.y -> two.u", "two.y -> one.u"], ["one", "two"], 1.0, 0.1, **EXPLICIT)


def hidden_rollback(folder: Path) -> Path:
    """Half of the state lies in a static variable that no saved state has."""
    circuit(folder)
    forgetful = "static double kept = 0.0;"
    step = "memory[0] = t; kept += h * (real[0] - kept); real[1] += h * (kept - 0.4 * real[1]);"
    variables = [real("u", "input", start=0.0), real("x", "output", start=0.0, initial="exact")]
    make_fmu(folder / "two.fmu", variables, head=forgetful, step=step, co_simulation=SMOOTH)
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_rates(folder: Path) -> Path:
    """Output derivatives of another unit, such as per minute."""
    offered = {**SMOOTH, "maxOutputDerivativeOrder": "1"}
    first_order(folder / "one.fmu", "-u", 1.0, co_simulation=offered, rates="update(m); rate[1] = m->real[2];")
    first_order(
        folder / "two.fmu",
        "u - 0.4 * real[1]",
        0.0,
        co_simulation=offered,
        rates="update(m); rate[1] = 3.0 * m->real[2];",
    )
    return scene(folder, *PAIR, 4.0, 0.05, exchange="hermite", waveform="hermite")


def healthy_with_unused_rates(folder: Path) -> Path:
    hidden_rates(folder)
    return scene(folder, *PAIR, 4.0, 0.05)


def healthy_with_one_step_length(folder: Path) -> Path:
    fixed = {**SMOOTH, "canHandleVariableCommunicationStepSize": "false", "maxOutputDerivativeOrder": "1"}
    circuit(folder, co_simulation=fixed, rates="update(m); rate[1] = m->real[2];")
    return scene(folder, *PAIR, 4.0, 0.05)


def healthy_until_its_end(folder: Path) -> Path:
    """The filter ends the simulation after 0.4 s, as its wish."""
    sine(folder / "source.fmu", 2.0)
    ends = "if (t > 0.375) { m->terminated = 1; m->reached = t; return fmi2Discard; }" + STEP
    first_order(folder / "filter.fmu", "u - real[1]", 0.0, step=ends)
    return scene(folder, *CHAIN, 1.0, 0.05)


def failing_part(folder: Path) -> Path:
    circuit(folder)
    fails = 'LOG(fmi2Error, "no model here"); return fmi2Error;'
    first_order(folder / "two.fmu", "u - 0.4 * real[1]", 0.0, step=fails, units=VOLT, unit=("V", "A"))
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_counter(folder: Path) -> Path:
    """Takes every step for one of 0.05 s."""
    circuit(folder)
    variables = [real("u", "input", start=0.0), real("x", "output", start=0.0, initial="exact")]
    make_fmu(folder / "two.fmu", variables, step="real[1] += 0.05 * (real[0] - 0.4 * real[1]);", co_simulation=SMOOTH)
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_noise(folder: Path) -> Path:
    circuit(folder)
    noisy = (
        "memory[0] = t; fmi2Status s = integrate(m, h); real[1] += 2e-3 * (rand() / (double)RAND_MAX - 0.5); return s;"
    )
    first_order(folder / "two.fmu", "u - 0.4 * real[1]", 0.0, step=noisy, units=VOLT, unit=("V", "A"))
    return scene(folder, *PAIR, 4.0, 0.05, tolerance=1e-2)


def hidden_other_model(folder: Path) -> Path:
    """Co-simulation integrates another resistor than model exchange."""
    circuit(folder)
    resistor = "(m->interface == fmi2CoSimulation ? 0.8 : 0.4)"
    how = {"units": VOLT, "unit": ("V", "A"), "model_exchange": {}}
    first_order(folder / "two.fmu", f"u - {resistor} * real[1]", 0.0, **how)
    return scene(folder, *PAIR, 4.0, 0.05)


def hidden_held_inputs(folder: Path) -> Path:
    """Declares to interpolate inputs and holds them."""
    circuit(folder)
    held = "double u = real[0]; real[2] = u - 0.4 * real[1];"
    variables = [
        real("u", "input", start=0.0),
        real("x", "output", start=0.0, initial="exact"),
        real("der(x)", "local"),
    ]
    make_fmu(folder / "two.fmu", variables, output=held, states={"x": "der(x)"}, co_simulation=SMOOTH)
    return scene(folder, *PAIR, 4.0, 0.05)


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
    found = coupling.verify(tca.read(build(tmp_path)))
    assert (found.verdict, found.trusted) == (verdict, verdict == "healthy"), found.reasons
    assert said in "\n".join(found.reasons), found.reasons
    json.dumps(coupling.as_json(found), allow_nan=False)
    coupling.write_html(found, tmp_path / "page.html")
    checker = html.parser.HTMLParser()
    checker.feed((tmp_path / "page.html").read_text(encoding="utf-8"))


def test_the_circuit_has_a_power_bond_that_closes(tmp_path: Path) -> None:
    found = coupling.verify(tca.read(healthy_circuit(tmp_path)))
    (bond,) = found.bonds
    assert (str(bond.forward), str(bond.backward)) == ("one.x -> two.u", "two.x -> one.u")
    assert bond.closed
    assert bond.shares[0] > bond.shares[1] > bond.shares[2]
    assert found.monolith.agrees is True
    orders = {signal.name: signal.order for signal in found.signals}
    assert orders["one.x"] == pytest.approx(2.0, abs=0.3)  # linear waveform


@pytest.mark.parametrize("order", [1, 2, 4])
def test_errors_are_estimated_by_the_observed_order(order: int) -> None:
    """y + c H^p, of which everything is known."""
    t = np.linspace(0.0, 1.0, 11)
    courses = [t + 0.3 * (0.5**k * 0.5) ** order * t**2 for k in range(3)]
    found = assess_signal("one.x", "m", courses, 0.5, 0.001)
    exact = 0.3 * 0.5**order * float(np.sqrt(np.mean(t**4)))
    assert found.order == pytest.approx(order, abs=1e-6)
    assert found.error == pytest.approx(exact / float(np.ptp(courses[-1])), rel=1e-6)
    assert found.kind == "step"
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
        found = assess_signal("a.y", "m", courses, 0.1, 0.01)
        assert found.kind == kind, (courses, found.text)


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
