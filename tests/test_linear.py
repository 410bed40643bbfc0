"""Linear models against the full co-simulation, their reduction, their files."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import tca_cosim.cli
from scipy.io import loadmat
from tca_cosim.cosim.signals import Sine
from tca_cosim.linear import LinearModel, balanced_truncation, linearise, load, save
from tca_cosim.linear.linearisation import linearise_now
from tca_cosim.linear.reduction import hankel_singular_values
from typer.testing import CliRunner

# A damped rod, heated until all is at rest: with voltages that are not 0, so that they act to first order.
AT_REST = {
    "rod.dynamic": True,
    "rod.closure": "inside",
    "rod.order": 1,
    "rod.tolerance": 1e-9,
    "thermal.V": [0.6, 1.0, 1.5],
    "stop_time": 5000.0,
    "coupling.macro_step": 50.0,
}
VOLTAGE, FORCE = "thermal.V[2]", "rod.tip_force[1]"
SMALL = {VOLTAGE: 1e-3, FORCE: 1e-6}


@pytest.fixture(scope="module")
def at_rest() -> Iterator[tuple[tca.Simulation, tca.stepping.SavedState, LinearModel]]:
    with tca.Simulation("step", AT_REST) as sim:
        sim.step(3000.0)
        state = sim.save()
        yield sim, state, linearise_now(sim).select([VOLTAGE, FORCE], ["rod.tip.p", "thermal.T"])


def outputs(sim: tca.Simulation) -> np.ndarray:
    return np.concatenate([sim["rod.tip.p"], sim["thermal.T"]])


@pytest.mark.parametrize(
    ("name", "width", "times"), [(VOLTAGE, 0.5, [1.0, 3.0, 10.0, 40.0]), (FORCE, 0.02, [0.05, 0.1, 0.2, 0.5])]
)
def test_impulse_response_is_that_of_the_co_simulation(
    at_rest, name: str, width: float, times: list[float], at_most
) -> None:
    sim, state, model = at_rest
    column = [q.name for q in model.inputs].index(name)
    responses = []
    for sign in (1.0, -1.0):
        sim.restore(state)
        sim.step(state.time + width, {name: model.u_0[column] + sign * SMALL[name]})
        sim.set_inputs({name: model.u_0[column]})
        rows = []
        for time in times:
            sim.step(state.time + time)
            rows.append(outputs(sim))
        responses.append(np.array(rows))
    measured = (responses[0] - responses[1]) / (2.0 * SMALL[name])
    expected = (model.step_response(np.array(times)) - model.step_response(np.array(times) - width))[:, :, column]
    acts = np.abs(expected).max(axis=0) > 0.0
    assert acts[:3].all()
    error = np.abs(measured - expected).max(axis=0)[acts] / np.abs(expected).max(axis=0)[acts]
    at_most(f"response to a pulse of {name}, relative error", error.max(), 1e-4)


@pytest.mark.parametrize(
    ("name", "frequency", "settle"), [(VOLTAGE, 0.02, 1200.0), (FORCE, 2.0, 8.0), (FORCE, 6.0, 8.0)]
)
def test_frequency_response_is_that_of_the_co_simulation(
    at_rest, name: str, frequency: float, settle: float, at_most
) -> None:
    sim, state, model = at_rest
    column, points = [q.name for q in model.inputs].index(name), 24
    cycles = round(settle * frequency)
    phase = -2.0 * np.pi * frequency * state.time
    responses = []
    for sign in (1.0, -1.0):
        sim.restore(state)
        sim.set_inputs({name: Sine(model.u_0[column], sign * SMALL[name], 1.0 / frequency, phase)})
        rows = []
        for k in range(1, (cycles + 1) * points + 1):
            sim.step(state.time + k / points / frequency)
            rows.append(outputs(sim))
        responses.append(np.array(rows[-points:]))
    measured = (responses[0] - responses[1]) / (2.0 * SMALL[name])
    angles = 2.0 * np.pi * np.arange(1, points + 1) / points
    gain = 2j / points * (measured * np.exp(-1j * angles)[:, None]).sum(axis=0)
    expected = model.frequency_response(np.array([frequency]))[0][:, column]
    acts = np.abs(expected) > 1e-9  # the temperatures do not feel the force
    error = np.abs(gain - expected)[acts] / np.abs(expected)[acts]
    at_most(f"response to {name} at {frequency:g} Hz, relative error", error.max(), 1e-4)


def test_a_closed_loop_is_that_of_the_closure_inside() -> None:
    inside = linearise("step", 5.0, {"rod.closure": "inside"}).select(["thermal.V"], ["rod.tip.p", "rod.delta"])
    exchanged = linearise("step", 5.0, {"coupling.tolerance": 1e-10}).select(["thermal.V"], ["rod.tip.p", "rod.delta"])
    for key in "ABCD":
        one, other = getattr(inside, key), getattr(exchanged, key)
        np.testing.assert_allclose(other, one, rtol=0.0, atol=1e-7 * max(np.abs(one).max(), 1e-12))


def test_states_that_a_level_lacks_are_left_out() -> None:
    static = linearise("step", 1.0)
    assert all(q.name.startswith("thermal.mode[") for q in static.states)
    moving = linearise("step", 1.0, {"rod.dynamic": True, "rod.closure": "inside", "rod.order": 0})
    rods = [q.name for q in moving.states if q.name.startswith("rod.strain")]
    assert len(rods) == 12
    assert all("[1," in name for name in rods)
    assert static.select(["thermal.V"]).B.shape[1] == 3
    with pytest.raises(tca.SceneError, match=r"rod\.tip\.q: the linear model has no such output"):
        static.select(outputs=["rod.tip.q"])


def test_reduction_keeps_its_bound() -> None:
    model = linearise("step", 5.0, {"rod.dynamic": True, "rod.closure": "inside"}).select(["thermal.V"], ["rod.tip.p"])
    values = hankel_singular_values(model)
    assert (np.diff(values) <= 0.0).all()
    frequencies = np.array([1e-3, 1e-2, 0.1, 1.0, 5.0, 20.0])
    scale = np.array([q.nominal for q in model.outputs])[:, None]
    for order in (4, 10, 20):
        reduced = balanced_truncation(model, order)
        assert len(reduced.A) == order
        difference = (reduced.frequency_response(frequencies) - model.frequency_response(frequencies)) / scale
        gain = np.linalg.norm(difference, 2, axis=(1, 2)).max()
        assert gain <= 2.0 * values[order:].sum() * (1.0 + 1e-6)
        assert gain > 0.0
    assert len(balanced_truncation(model, tolerance=1e-3).A) < len(balanced_truncation(model, tolerance=1e-6).A)
    with pytest.raises(tca.SceneError, match="give 1 to"):
        balanced_truncation(model, 1000)


def test_an_undamped_rod_is_not_balanced_and_the_remedy_works() -> None:
    free = {"rod.dynamic": True, "rod.closure": "inside", "rod.order": 1, "rod.body.retardation": 0.0}
    with pytest.raises(tca.SceneError, match=r"body\.retardation"):
        balanced_truncation(linearise("step", 0.0, free).select(["rod.tip_force"], ["rod.tip.p"]), 4)
    damped = free | {"rod.body.retardation": 5e-3}
    balanced_truncation(linearise("step", 0.0, damped).select(["rod.tip_force"], ["rod.tip.p"]), 4)


def test_an_integral_is_not_balanced_and_the_remedy_works() -> None:
    """The dissipated energy grows and grows; without it a damped rod is reduced."""
    model = linearise("drop", 0.5)
    message = r"rod\.dissipation: an integral.*choose outputs \(--output\) without rod\.energy\.dissipated"
    with pytest.raises(tca.SceneError, match=message):
        balanced_truncation(model, 4)
    outputs = [q.name for q in model.outputs if q.name != "rod.energy.dissipated"]
    inputs = [q.name for q in model.inputs]
    assert len(balanced_truncation(model.select(inputs, outputs), 4).A) == 4


def test_files_say_the_same_in_every_kind(tmp_path: Path) -> None:
    control = pytest.importorskip("control")
    result = CliRunner().invoke(
        tca.cli.app,
        ["linearise", "step", "--time", "3", "--input", "thermal.V", "--output", "rod.tip.p", "--out", str(tmp_path)],
    )
    assert result.exit_code == 0, result.output
    model = load(tmp_path / "step.linear.npz")
    other = load(tmp_path / "step.linear.json")
    mat = loadmat(tmp_path / "step.linear.mat")
    for key in ("A", "B", "C", "D"):
        assert (getattr(model, key) == getattr(other, key)).all()
        assert (getattr(model, key) == mat[key]).all()
    assert [str(name[0]) for name in mat["inputs"].ravel()] == ["thermal.V[1]", "thermal.V[2]", "thermal.V[3]"]
    assert json.loads((tmp_path / "step.linear.json").read_text())["output_units"] == ["m", "m", "m"]
    file = np.load(tmp_path / "step.linear.npz")
    system = control.ss(file["A"], file["B"], file["C"], file["D"])
    expected = model.frequency_response(np.array([0.05]))[0]
    np.testing.assert_allclose(system(2j * np.pi * 0.05), expected, rtol=1e-9)
    control_again = LinearModel(
        **{key: np.asarray(getattr(system, key)) for key in "ABCD"},
        **{key: getattr(model, key) for key in ("states", "inputs", "outputs", "x_0", "u_0", "y_0", "drift")},
    )
    save(control_again, tmp_path / "again.npz")
    np.testing.assert_array_equal(load(tmp_path / "again.npz").A, model.A)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("x.npz", b"no archive", "not a linear model"),
        ("x.json", b"{}", "not a linear model"),
        ("x.npz", b"PK\x03\x04 cut off", "not a linear model"),
        ("x.npz", b"", "not a linear model"),
        ("x.txt", b"", r"read from \.npz and \.json"),
    ],
)
def test_files_that_are_no_models_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(tca.SceneError, match=message):
        load(tmp_path / name)


def test_heat_without_continuous_states_is_refused_and_the_remedies_work() -> None:
    with pytest.raises(
        tca.SceneError, match=r"thermal\.level = full: .*set thermal\.level = reduced \(with convection"
    ):
        linearise("fan", 1.0)
    reduced = linearise("fan", 1.0, {"thermal.level": "reduced", "thermal.convection": "constant"})
    lumped = linearise("fan", 1.0, {"thermal.level": "lumped"})
    assert len(reduced.A) > len(lumped.A) > 0


def test_what_cannot_be_reduced_or_answered_is_refused() -> None:
    model = linearise("step", 1.0)
    for options, message in (
        ({"order": 31}, "give 1 to 30"),
        ({"order": 2.5}, "give 1 to 30"),
        ({"order": 3, "tolerance": 0.1}, "each decides alone; give one of them"),
        ({"tolerance": float("nan")}, "give a share between 0 and 1"),
        ({"tolerance": -1.0}, "give a share between 0 and 1"),
    ):
        with pytest.raises(tca.SceneError, match=message):
            balanced_truncation(model, **options)
    for order in (None, 1):
        with pytest.raises(tca.SceneError, match="no state connects these inputs and outputs"):
            balanced_truncation(model.select("rod.tip_force", "rod.tip.p"), order)
    for response in (model.impulse_response, model.step_response, model.frequency_response):
        with pytest.raises(tca.SceneError, match="give finite numbers"):
            response([0.0, float("nan")])
    with pytest.raises(tca.SceneError, match=r"times: -1; give finite numbers from 0 on"):
        model.step_response([-1.0])


def test_times_outside_of_the_scene_are_refused() -> None:
    with pytest.raises(tca.SceneError, match="set stop_time"):
        linearise("step", 31.0)
