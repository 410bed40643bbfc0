"""FMUs that offer model exchange alone run under the master as others do: coupled, iterated, with events, set back."""

from __future__ import annotations

import json
import math
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from fmu_maker import boolean, integer, make_fmu, real
from scipy.linalg import expm
from tca_cosim import SubsystemError
from tca_cosim.cosim.subsystem import Subsystem
from tca_cosim.errors import TerminationRequest
from tca_cosim.fmi.archive import Archive
from tca_cosim.fmi.model_exchange import ModelExchangeInstance

GRAVITY = 9.81  # m/s^2


def oscillator(path: Path, **options: object) -> Path:
    """x'' = -x - 0.1 x' + (u - x), the spring between two of them of stiffness 1 N/m."""
    return make_fmu(
        path,
        [
            real("u", "input", start=0.0, unit="m"),
            real("x", start=1.0, unit="m"),
            real("v", start=0.0),
            real("der(x)", "local"),
            real("der(v)", "local"),
        ],
        states={"x": "der(x)", "v": "der(v)"},
        **{
            "output": "real[3] = real[2]; real[4] = -real[1] - 0.1 * real[2] + (real[0] - real[1]);",
            "cs": False,
            "model_exchange": {},
            **options,
        },
    )


def ball(path: Path, **options: object) -> Path:
    """A ball dropped from 1 m that keeps 7/10 of its speed; it keeps the time of its last impact."""
    return make_fmu(
        path,
        [
            real("height", start=1.0),
            real("speed", start=0.0),
            real("der(height)", "local"),
            real("der(speed)", "local"),
            real("impact", variability="discrete", start=0.0),
            real("push", "input", start=0.0),
        ],
        states={"height": "der(height)", "speed": "der(speed)"},
        indicators=1,
        **{
            "output": f"real[2] = real[1]; real[3] = real[5] - {GRAVITY}; indicator[0] = real[0];",
            "event": "if (real[0] <= 0.0 && real[1] < 0.0) { real[0] = 0.0; real[1] *= -0.7; real[4] = m->time; }",
            "cs": False,
            "model_exchange": {},
            **options,
        },
    )


def instance(path: Path, inputs: tuple[str, ...] = (), outputs: tuple[str, ...] = ()) -> ModelExchangeInstance:
    made = ModelExchangeInstance(Archive(path), "fmu", {}, inputs, outputs, (), 0.0, 10.0)
    made.initialise(0.0, np.zeros(len(inputs)))
    made.begin()
    return made


def run(tmp_path: Path, text: str) -> object:
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    return tca.run(tca.read(tmp_path / "scene.toml"))


def test_two_oscillators_against_their_exact_motion(tmp_path: Path) -> None:
    for name in ("a", "b"):
        oscillator(tmp_path / f"{name}.fmu", identifier=name)
    text = """
stop_time = 0.5
connections = ["a.x -> b.u", "b.x -> a.u"]
[fmus]
a = "a.fmu"
b = "b.fmu"
[coupling]
macro_step = 0.02
waveform = "hermite"
tolerance = 1e-10
"""
    result = run(tmp_path, text)
    matrix = np.array([[0, 1, 0, 0], [-2, -0.1, 1, 0], [0, 0, 0, 1], [1, 0, -2, -0.1]])
    motion = np.array([expm(matrix * t) @ [1.0, 0.0, 1.0, 0.0] for t in result["time"].values])
    assert np.abs(result["a.x"].values - motion[:, 0]).max() < 1e-8
    assert np.abs(result["b.x"].values - motion[:, 2]).max() < 1e-8
    assert result["coupling.sweeps"][1:].mean() > 1.5
    assert json.loads(result.attrs["statistics"])["rollbacks"] > 0


def test_a_bouncing_ball_beside_a_controller(tmp_path: Path) -> None:
    """Impacts are where they are in closed form; the controller of co-simulation follows the height in its loop."""
    ball(tmp_path / "ball.fmu")
    make_fmu(
        tmp_path / "controller.fmu",
        [real("h", "input", start=1.0), real("push")],
        step="memory[0] = 0.0 * real[0];",
        output="real[1] = memory[0];",
    )
    text = """
stop_time = 1.2
connections = ["ball.height -> controller.h", "controller.push -> ball.push"]
[fmus]
ball = "ball.fmu"
controller = "controller.fmu"
[coupling]
macro_step = 0.05
exchange = "held"
waveform = "held"
"""
    result = run(tmp_path, text)
    first = math.sqrt(2.0 / GRAVITY)
    second = first + 2.0 * 0.7 * first
    impacts = result["ball.impact"].values
    time = result["time"].values
    assert np.abs(impacts[(time > first + 1e-6) & (time < second - 1e-6)] - first).max() < 1e-9
    assert np.abs(impacts[time > second + 1e-6] - second).max() < 1e-9
    flight = time - first
    height = 0.7 * GRAVITY * first * flight - 0.5 * GRAVITY * flight**2
    between = (time > first) & (time < second)
    np.testing.assert_allclose(result["ball.height"].values[between], height[between], atol=1e-9)


def test_both_interfaces_of_one_fmu_agree(tmp_path: Path) -> None:
    """The same equations; the FMU's own co-simulation takes 200 Runge-Kutta steps of order 4 in each macro step."""
    oscillator(tmp_path / "me.fmu")
    oscillator(tmp_path / "cs.fmu", cs=True, model_exchange=None, substeps=200)
    ends = []
    for name in ("me", "cs"):
        text = (
            f'stop_time = 1\nconnections = []\n[fmus]\na = "{name}.fmu"\n[a]\nu = 1.0\n[coupling]\nmacro_step = 0.1\n'
        )
        ends.append(run(tmp_path, text)["a.x"].values[-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-8)


def test_inputs_are_followed_over_the_step(tmp_path: Path) -> None:
    """x' = u with a cubic input is exact in one step, and the rate of the output is that of the input."""
    path = make_fmu(
        tmp_path / "integrator.fmu",
        [real("u", "input", start=0.0), real("x", start=0.0), real("der(x)", "local")],
        output="real[2] = real[0];",
        states={"x": "der(x)"},
        cs=False,
        model_exchange={},
    )
    with closing(instance(path, ("u",), ("x",))) as fmu:
        assert isinstance(fmu, Subsystem)
        fmu.set_inputs(np.array([[1.0], [2.0], [-3.0], [4.0]]))
        fmu.step(0.0, 0.5)
        s = 0.5
        assert fmu.values()[0] == pytest.approx(s + s**2 - s**3 / 2 + s**4 / 6, abs=1e-9)
        assert fmu.rates()[0] == pytest.approx(1 + 2 * s - 1.5 * s**2 + 4 / 6 * s**3, abs=1e-7)
        assert fmu.values()[0] == pytest.approx(s + s**2 - s**3 / 2 + s**4 / 6, abs=1e-9)  # rates leave no trace


@pytest.mark.parametrize("state", [True, False], ids=["saved state", "continuous states"])
def test_a_step_taken_back_is_the_same_again(state: bool, tmp_path: Path) -> None:
    with closing(instance(oscillator(tmp_path / "a.fmu", state=state), ("u",), ("x",))) as fmu:
        fmu.set_inputs(np.array([[0.3], [1.0], [0.0], [0.0]]))
        before = fmu.save()
        fmu.step(0.0, 0.5)
        once = fmu.values()
        fmu.restore(before)
        assert fmu.values()[0] == 1.0
        fmu.set_inputs(np.array([[0.3], [1.0], [0.0], [0.0]]))
        fmu.step(0.0, 0.5)
        np.testing.assert_array_equal(fmu.values(), once)
        fmu.free(before)


def test_without_a_saved_state_an_event_is_not_taken_back(tmp_path: Path) -> None:
    for state in (True, False):
        path = ball(tmp_path / f"ball{state}.fmu", state=state)
        with closing(instance(path, (), ("height", "impact"))) as fmu:
            before = fmu.save()
            fmu.step(0.0, 0.6)
            assert fmu.values()[1] == pytest.approx(math.sqrt(2.0 / GRAVITY), abs=1e-9)
            if state:
                fmu.restore(before)
                np.testing.assert_array_equal(fmu.values(), [1.0, 0.0])
            else:
                with pytest.raises(SubsystemError, match="across an event"):
                    fmu.restore(before)


def test_time_events_and_discrete_inputs(tmp_path: Path) -> None:
    """A counter that samples every 0.1 s by time events while its Boolean input is on."""
    path = make_fmu(
        tmp_path / "counter.fmu",
        [boolean("on", "input", start="true"), integer("count"), real("sampled", variability="discrete")],
        output="integer[0] = (int)memory[0]; real[0] = memory[1];",
        event="""if (m->time >= memory[2] - 1e-12) {
  if (m->time > 1e-9 && boolean[0]) { memory[0] += 1; memory[1] = m->time; }
  memory[2] = 0.1 * (floor(m->time / 0.1 + 1e-9) + 1);
}
m->next_event = memory[2];""",
        cs=False,
        model_exchange={},
    )
    with closing(instance(path, ("on",), ("count", "sampled"))) as fmu:
        inputs = np.zeros((4, 1))
        inputs[0] = 1.0
        fmu.set_inputs(inputs)
        fmu.step(0.0, 0.35)
        assert fmu.values() == pytest.approx([3.0, 0.3])
        fmu.set_inputs(0.0 * inputs)
        fmu.step(0.35, 0.35)
        assert fmu.values() == pytest.approx([3.0, 0.3])
        fmu.set_inputs(inputs)
        fmu.step(0.7, 0.1)  # an event at the end of a step belongs to it
        assert fmu.values() == pytest.approx([4.0, 0.8])


def test_a_model_that_ends_the_simulation(tmp_path: Path) -> None:
    path = ball(tmp_path / "ball.fmu", event="if (real[0] <= 0.0 && real[1] < 0.0) m->terminated = 1;")
    with closing(instance(path, (), ("height",))) as fmu, pytest.raises(TerminationRequest) as caught:
        fmu.step(0.0, 1.0)
    assert caught.value.reached == pytest.approx(math.sqrt(2.0 / GRAVITY), abs=1e-9)


def test_a_run_ends_when_a_model_wishes(tmp_path: Path) -> None:
    ball(tmp_path / "ball.fmu", event="if (real[0] <= 0.0 && real[1] < 0.0) m->terminated = 1;")
    result = run(
        tmp_path,
        'stop_time = 1\nconnections = []\n[fmus]\nball = "ball.fmu"\n[coupling]\nmacro_step = 0.1\n',
    )
    assert result.attrs["status"] == "complete"
    assert "ball ended the simulation" in result.attrs["ended"]
    assert result["time"].values[-1] == pytest.approx(math.sqrt(2.0 / GRAVITY), abs=1e-9)
    assert abs(float(result["ball.height"][-1])) < 1e-8


def test_a_model_that_switches_without_end_is_named(tmp_path: Path) -> None:
    path = ball(
        tmp_path / "ball.fmu", event="if (real[0] <= 0.0 && real[1] < 0.0) { real[0] = 1e-13; real[1] = -1.0; }"
    )
    with closing(instance(path, (), ("height",))) as fmu, pytest.raises(SubsystemError, match="switches"):
        fmu.step(0.0, 1.0)


def test_a_slope_that_is_not_finite_is_named(tmp_path: Path) -> None:
    path = oscillator(tmp_path / "a.fmu", output="real[3] = real[2]; real[4] = m->time > 0.2 ? NAN : 0.0;")
    with closing(instance(path, ("u",), ("x",))) as fmu, pytest.raises(SubsystemError, match="not finite"):
        fmu.step(0.0, 1.0)
