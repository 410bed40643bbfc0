"""The monolith with events of FMUs: state, time and step events against closed forms, and what is refused by name."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmu_maker import boolean, integer, make_fmu, real
from tca_cosim import CosimError, SceneError, SubsystemError
from tca_cosim.verification import monolith
from tca_cosim.verification.monolith.modes import AT_REST

BALL = [
    real("h", "output", start=1.0, initial="exact"),
    real("v", "output", start=0.0, initial="exact"),
    real("der(h)", "local"),
    real("der(v)", "local"),
    real("bounces", "output"),
]
FALL = "real[2] = real[1]; real[3] = -9.81; real[4] = memory[0]; indicator[0] = real[0];"
BOUNCE = "if (real[0] <= 0.0 && real[1] < 0.0) { real[0] = 0.0; real[1] = -0.7 * real[1]; memory[0] += 1.0; }"
STATES = {"h": "der(h)", "v": "der(v)"}


def scene(folder: Path, text: str, *names: str) -> tca.Scene:
    fmus = "".join(f'{name} = "{name}.fmu"\n' for name in names)
    (folder / "system.toml").write_text(f"{text}\n[fmus]\n{fmus}")
    return tca.read(folder / "system.toml")


def test_state_events_are_located(tmp_path: Path) -> None:
    """A ball that falls from 1 m bounces first at sqrt(2/g), and again 1.4 times that later."""
    make_fmu(tmp_path / "ball.fmu", BALL, output=FALL, event=BOUNCE, states=STATES, indicators=1, model_exchange={})
    described = scene(tmp_path, "stop_time = 1.5\ncoupling.macro_step = 0.05\nconnections = []", "ball")
    actual = monolith.solve_monolith(described, 1e-11)
    t, h = actual["time"].to_numpy(), actual["ball.h"].to_numpy()
    first = math.sqrt(2.0 / 9.81)
    second = first + 2.0 * 0.7 * first
    speed = 0.7 * 9.81 * first
    later = t - first
    exact = np.where(t < first, 1.0 - 0.5 * 9.81 * t**2, speed * later - 0.5 * 9.81 * later**2)
    before = t < second
    np.testing.assert_allclose(h[before], exact[before], atol=1e-8)
    assert actual["ball.bounces"].to_numpy()[[0, -1]].tolist() == [0.0, 2.0]


def test_events_that_accumulate_are_named(tmp_path: Path) -> None:
    """It bounces forever before 5.7 sqrt(2/g)."""
    make_fmu(tmp_path / "ball.fmu", BALL, output=FALL, event=BOUNCE, states=STATES, indicators=1, model_exchange={})
    described = scene(tmp_path, "stop_time = 4\ncoupling.macro_step = 4\nconnections = []", "ball")
    with pytest.raises(CosimError, match=r"events of ball accumulate at t = 2\.5"):
        monolith.solve_monolith(described, 1e-8)


def test_time_events_are_hit_exactly(tmp_path: Path) -> None:
    """A controller that samples every 0.3 s and holds: x' = -u, u = x of the last sample."""
    plant = [real("u", "input", start=0.0), real("x", "output", start=1.0, initial="exact"), real("der(x)", "local")]
    make_fmu(tmp_path / "plant.fmu", plant, output="real[2] = -real[0];", states={"x": "der(x)"}, model_exchange={})
    sampler = [real("x", "input", start=0.0), real("u", "output")]
    sample = "memory[0] = real[0]; m->next_event = 0.3 * ((int)floor(t / 0.3 + 1e-9) + 1);"
    make_fmu(tmp_path / "sampler.fmu", sampler, output="real[1] = memory[0];", event=sample, model_exchange={})
    wires = 'connections = ["plant.x -> sampler.x", "sampler.u -> plant.u"]'
    # The sampler says nothing of dependencies, so its output counts as acting at once; a state does not.
    described = scene(tmp_path, f"stop_time = 1.2\ncoupling.macro_step = 0.1\n{wires}", "plant", "sampler")
    actual = monolith.solve_monolith(described, 1e-11)
    t = actual["time"].to_numpy()
    samples = 0.7 ** np.arange(6)
    k = np.minimum(np.floor(t / 0.3 + 1e-9).astype(int), 5)
    np.testing.assert_allclose(actual["plant.x"].to_numpy(), samples[k] * (1.0 - (t - 0.3 * k)), atol=1e-9)


def test_an_fmu_may_end_the_run(tmp_path: Path) -> None:
    stop = "if (real[0] <= 0.5) m->terminated = 1;"
    output = "real[1] = -real[0]; indicator[0] = real[0] - 0.5;"
    variables = [real("x", "output", start=1.0, initial="exact"), real("der(x)", "local")]
    how = {"states": {"x": "der(x)"}, "indicators": 1, "model_exchange": {}}
    make_fmu(tmp_path / "tank.fmu", variables, output=output, event=stop, **how)
    described = scene(tmp_path, "stop_time = 3\ncoupling.macro_step = 0.5\nconnections = []", "tank")
    actual = monolith.solve_monolith(described, 1e-11)
    assert float(actual["time"][-1]) == pytest.approx(math.log(2.0), abs=1e-8)
    assert float(actual["tank.x"][-1]) == pytest.approx(0.5, abs=1e-8)


def test_what_cannot_be_integrated_is_named(tmp_path: Path) -> None:
    make_fmu(tmp_path / "only.fmu", [real("y", "output")], output="real[0] = t;")
    described = scene(tmp_path, "stop_time = 1\nconnections = []", "only")
    for solve in (monolith.solve_monolith, monolith.natural_modes):
        with pytest.raises(SubsystemError, match="offers no model exchange"):
            solve(described)
    make_fmu(tmp_path / "only.fmu", [real("y", "output")], output="real[0] = t;", model_exchange={})
    described = scene(tmp_path, "stop_time = 1\ncoupling.macro_step = 0.25\nconnections = []", "only")
    assert monolith.solve_monolith(described)["only.y"].to_numpy().tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    with pytest.raises(SceneError, match="so there are no modes"):
        monolith.natural_modes(described)


def test_discrete_connections_are_refused_by_name(tmp_path: Path) -> None:
    make_fmu(tmp_path / "a.fmu", [integer("n", "output", start=3, initial="exact")], model_exchange={})
    make_fmu(tmp_path / "b.fmu", [integer("n", "input", start=0), boolean("on", "output")], model_exchange={})
    text = 'stop_time = 1\nconnections = ["a.n -> b.n"]'
    with pytest.raises(SceneError, match=r"passes Real values only|no Real output"):
        monolith.solve_monolith(scene(tmp_path, text, "a", "b"))


def test_modes_without_directional_derivatives(tmp_path: Path) -> None:
    """An oscillator of 3 rad/s with a damping ratio of 0.1, by differences; away from rest that is said."""
    variables = [
        real("x", "output", start=0.0, initial="exact"),
        real("v", "output", start=0.0, initial="exact"),
        real("der(x)", "local"),
        real("der(v)", "local"),
    ]
    rates = "real[2] = real[1]; real[3] = -9.0 * real[0] - 0.6 * real[1];"
    how = {"output": rates, "states": {"x": "der(x)", "v": "der(v)"}, "model_exchange": {}}
    make_fmu(tmp_path / "mass.fmu", variables, **how)
    actual = monolith.natural_modes(scene(tmp_path, "stop_time = 1\nconnections = []", "mass"))
    (mode,) = actual.modes
    assert mode.frequency == pytest.approx(3.0 / (2.0 * math.pi), rel=1e-6)
    assert mode.damping == pytest.approx(0.1, rel=1e-6)
    assert actual.remarks == []
    variables[0] = real("x", "output", start=0.2, initial="exact")
    make_fmu(tmp_path / "mass.fmu", variables, **how)
    moved = monolith.natural_modes(scene(tmp_path, "stop_time = 1\nconnections = []", "mass"))
    assert moved.offsets["mass"] == pytest.approx(0.2, rel=1e-6)
    assert moved.offsets["mass"] > AT_REST
    assert "mass is not at equilibrium (about 0.2 nominals" in moved.remarks[0]


LEAK = [real("u", "input", start=0.0), real("x", "output", start=1.0, initial="exact"), real("der(x)", "local")]
FAULTS: dict[str, dict[str, object]] = {
    "no outputs": {"variables": [real("u", "input", start=0.0)], "states": {}},
    "no variables": {"variables": [], "states": {}},
    "a rate that is not finite": {"output": "real[2] = t > 0.2 ? NAN : -real[1];"},
    "a rate that grows beyond all numbers": {"output": "real[2] = 1e6 * real[1] * real[1];"},
    "an indicator that is not finite": {"output": "real[2] = -real[1]; indicator[0] = NAN;", "indicators": 1},
    "a time event in the past": {"event": "m->next_event = m->time - 1.0;"},
    "a time event now, again and again": {"event": "m->next_event = m->time;"},
    "a time event that is not a number": {"event": "m->next_event = NAN;"},
    "a state that is not finite after an event": {"event": "if (t > 0.1) real[1] = INFINITY; m->next_event = 0.2;"},
    "no derivative attribute": {"xml": lambda text: text.replace(' derivative="2"', "")},
    "a nominal of zero": {"xml": lambda text: text.replace('start="1.0"', 'start="1.0" nominal="0"')},
    "more derivatives than there are": {
        "xml": lambda text: text.replace('<Unknown index="3"/>', '<Unknown index="9"/>')
    },
    "refused initialisation": {"enter": "return fmi2Error;"},
    "refused instance": {"instantiate": "return NULL;"},
}


@pytest.mark.parametrize("fault", FAULTS)
def test_any_fault_is_a_message_and_no_traceback(fault: str, tmp_path: Path) -> None:
    how = {"output": "real[2] = -real[1];", "states": {"x": "der(x)"}, "model_exchange": {}, **FAULTS[fault]}
    make_fmu(tmp_path / "leak.fmu", how.pop("variables", LEAK), **how)
    text = "stop_time = 0.5\ncoupling.macro_step = 0.25\nconnections = []"
    for solve in (monolith.solve_monolith, monolith.natural_modes):
        try:
            solve(scene(tmp_path, text, "leak"))
        except CosimError as error:
            assert "leak" in str(error) or "system" in str(error) or "monolith" in str(error)  # noqa: PT017
            assert len(str(error)) > 20  # noqa: PT017
