"""The engine: many runs in one call give the master's numbers, failures stay with their run, mistakes are named."""

from __future__ import annotations

import signal

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.engine import binding, plan, watched_call
from tca_cosim.errors import CosimError
from tca_cosim.fmi import engine_library
from tca_cosim.studies import many_runs

LOOSE = ["rod.closure=inside", "rod.order=0", "coupling.macro_step=1 s", "thermal.tolerance=1e-3", "rod.tolerance=1e-3"]
OUTPUTS = ["rod.tip.p", "thermal.T", "thermal.V", "rod.energy.tca"]


def agree(batch: tca.BatchResult, k: int, alone: object, outputs: list[str]) -> None:
    """Run k of a batch is a run of its own, but for products of matrices, which numpy leaves to another library."""
    assert batch.failures[k] == ""
    assert np.array_equal(batch.times, alone["time"])
    for name in outputs:
        values = alone[name].to_numpy().reshape(len(batch.times), -1)
        scale = np.ptp(values) or np.abs(values).max()
        np.testing.assert_allclose(batch[name][k], values[1:], rtol=0.0, atol=1e-12 * scale)
        np.testing.assert_allclose(batch.initial[k, batch.columns[name]], values[0], rtol=0.0, atol=1e-12 * scale)


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("step", [*LOOSE, "stop_time=6"]),
        ("sine", ["rod.closure=inside", "stop_time=2"]),  # cubics in time
        ("switch", ["rod.closure=inside", "stop_time=12"]),  # events
        ("jump", ["rod.closure=inside", "stop_time=9"]),  # an event between macro steps
        ("drop", ["stop_time=0.1"]),  # dynamics
        ("step", [*LOOSE, "coupling.exchange=quadratic", "stop_time=6"]),
        ("sine", ["rod.closure=inside", "coupling.exchange=linear", "stop_time=2"]),
        ("sine", ["rod.closure=inside", "coupling.exchange=held", "stop_time=2"]),
        ("step", [*LOOSE, "coupling.macro_step=0.7 s", "stop_time=2"]),  # a shorter last step
        ("step", ["stop_time=2"]),  # an algebraic loop of one FMU with itself
        ("feedback", ["stop_time=2"]),  # of two FMUs
        ("feedback", ["stop_time=1", "coupling.schedule=jacobi"]),  # all outputs guessed
        ("feedback", ["stop_time=1", "coupling.waveform=held"]),
        ("switch", ["stop_time=16"]),  # with events
        ("jump", ["stop_time=12"]),  # inside of a macro step
        ("push", ["stop_time=8"]),  # a gain of hundreds near buckling
        ("tap", ["stop_time=0.1", "rod.closure=exchanged"]),  # inertia, and steps whose ends are rounded
    ],
)
def test_every_run_is_the_masters(name: str, overrides: list[str]) -> None:
    scene = tca.read(name, overrides)
    parameters = {"rod.body.E": np.array([37800.0, 45000.0, 33000.0]), "thermal.tca.R": np.array([6.9, 7.2, 6.5])}
    outputs = ["rod.tip.p", "thermal.T"]
    batch = tca.run_batch(scene, parameters, outputs=outputs, threads=2)
    assert batch.outputs.shape == (3, len(batch.times) - 1, 6)
    for k in range(3):
        agree(batch, k, tca.run(scene, {key: float(values[k]) for key, values in parameters.items()}), outputs)


def test_inputs_of_each_run_are_held_over_its_steps() -> None:
    scene = tca.read("step", [*LOOSE, "stop_time=5"])
    volts = np.random.default_rng(1).uniform(0.0, 3.0, (4, 5, 3))
    volts[2, 1:3] = volts[2, 0]  # an input that stays as it is
    batch = tca.run_batch(scene, inputs={"thermal.V": volts}, outputs=["rod.tip.p", "thermal.T", "thermal.V"])
    assert np.array_equal(batch["thermal.V"], volts)
    for k in (0, 2):
        steps = {
            f"thermal.V[{i + 1}]": {"steps": [[float(t), float(volts[k, t, i])] for t in range(5)]} for i in range(3)
        }
        agree(batch, k, tca.run(scene, steps), ["rod.tip.p", "thermal.T"])


def test_any_number_of_threads_and_the_order_of_runs_change_nothing() -> None:
    """An instance that has run is reset to what a new one is."""
    scene = tca.read("step", [*LOOSE, "stop_time=3"])
    parameters = {"thermal.h": np.linspace(15.0, 25.0, 7), "rod.body.E": np.linspace(3e4, 5e4, 7)}
    one, many = (tca.run_batch(scene, parameters, threads=threads) for threads in (1, 3))
    assert np.array_equal(one.outputs, many.outputs)
    turned = tca.run_batch(scene, {name: values[::-1] for name, values in parameters.items()}, threads=1)
    assert np.array_equal(one.outputs, turned.outputs[::-1])


@pytest.mark.parametrize("closure", ["inside", "exchanged"])
def test_what_fmus_warn_of_is_kept_for_each_run_and_said_once(closure: str) -> None:
    scene = tca.read("step", ["stop_time=1", f"rod.closure={closure}", "limits.temperature=1000"])
    with pytest.warns(
        tca.FmuWarning, match=r"^1 of 3 runs warn, the first, run 1, with: thermal: t = .* hottest"
    ) as said:
        batch = tca.run_batch(scene, {"thermal.tca.R": np.array([6.9, 0.3, 7.0])}, threads=1)
    assert len(said) == 1
    assert batch.failures == ("", "", "")
    assert [bool(text) for text in batch.warnings] == [False, True, False]


def test_a_loop_learns_nothing_from_the_run_before() -> None:
    scene = tca.read("feedback", ["stop_time=1"])
    values = {"rod.body.E": np.linspace(3e4, 5e4, 5)}
    one, many = (tca.run_batch(scene, values, threads=threads) for threads in (1, 3))
    turned = tca.run_batch(scene, {name: column[::-1] for name, column in values.items()}, threads=1)
    assert np.array_equal(one.outputs, many.outputs)
    assert np.array_equal(one.outputs, turned.outputs[::-1])


def test_a_loop_that_is_not_solved_says_what_helps() -> None:
    scene, values = tca.read("step", ["stop_time=1", "coupling.max_sweeps=3"]), {"rod.body.E": [37800.0]}
    batch = tca.run_batch(scene, values)
    assert batch.failures[0].startswith("rod: the algebraic loop is not solved after 3 sweeps, with a residual of ")
    assert "coupling.max_sweeps" in batch.failures[0]
    assert tca.run_batch(tca.read("step", ["stop_time=1"]), values).failures == ("",)


def test_loops_are_solved_by_plain_sums_where_those_of_numpy_are_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, values = tca.read("feedback", ["stop_time=1"]), {"rod.body.E": [37800.0, 45000.0]}
    expected = tca.run_batch(scene, values)
    monkeypatch.setattr(plan, "find_arithmetic", lambda unknowns, outputs: None)
    assert not plan.EnginePlan.of(scene, [], [], ["rod.tip.p"]).rounds_as_master
    actual = tca.run_batch(scene, values)
    assert actual.failures == ("", "")
    np.testing.assert_allclose(actual.outputs, expected.outputs, rtol=0.0, atol=1e-12)
    assert many_runs.EngineRuns.of(scene, values, ["rod.tip.p"]) is None  # whose numbers are the master's


def test_a_run_that_fails_leaves_the_others_alone() -> None:
    scene = tca.read("step", [*LOOSE, "stop_time=3"])
    good = tca.run_batch(scene, {"rod.body.E": np.array([37800.0])})
    batch = tca.run_batch(scene, {"rod.body.E": np.array([37800.0, -1.0, 37800.0])}, threads=1)
    assert "rod: " in batch.failures[1]
    assert "body.E" in batch.failures[1]
    assert np.isnan(batch.outputs[1]).all()
    for k in (0, 2):
        assert batch.failures[k] == ""
        assert np.array_equal(batch.outputs[k], good.outputs[0])


@pytest.mark.parametrize(
    ("name", "overrides", "arguments", "said"),
    [
        ("plain", [], {"parameters": {"rod.body.E": [1.0]}}, r"loop of rod by quasi-Newton.*coupling.method = 'iqn'"),
        ("step", ["coupling.waveform=hermite"], {"parameters": {"rod.body.E": [1.0]}}, r"coupling.waveform = 'linear'"),
        ("gripper", [], {"parameters": {"left.body.E": [1.0]}}, "object.force_left is iterated and has no nominal"),
        ("step", [*LOOSE, "coupling.control=doubling"], {"parameters": {"rod.body.E": [1.0]}}, "coupling.control"),
        (
            "step",
            [*LOOSE, "coupling.macro_step=1e-9"],
            {"parameters": {"rod.body.E": [1.0]}},
            r"3e\+10 steps.*macro step",
        ),
        ("step", LOOSE, {"parameters": {"rod.body.Ee": [1.0]}}, "no Real parameter"),
        ("step", LOOSE, {"parameters": {"rot.body.E": [1.0]}}, "no such FMU"),
        ("step", LOOSE, {"parameters": {"rod.body.E": [np.nan]}}, "not finite"),
        ("step", LOOSE, {"parameters": {"rod.body.E": [1.0, 2.0], "rod.tca.E": [1.0]}}, "give one for each run"),
        ("step", LOOSE, {}, "give one for each run"),
        ("step", LOOSE, {"inputs": {"rod.T": np.zeros((1, 30, 3))}}, "fed by another FMU"),
        ("step", LOOSE, {"inputs": {"thermal.V": np.zeros((1, 7, 3))}}, "30 macro steps"),
        ("step", LOOSE, {"inputs": {"thermal.V": np.zeros((1, 30, 2))}}, "3 columns"),
        ("step", LOOSE, {"parameters": {"rod.body.E": [1.0]}, "outputs": ["rod.tip"]}, "no Real input or output"),
    ],
)
def test_mistakes_are_named(name: str, overrides: list[str], arguments: dict, said: str) -> None:
    with pytest.raises(tca.SceneError, match=said):
        tca.run_batch(tca.read(name, overrides), **arguments)


def test_an_engine_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: object) -> None:
    monkeypatch.setattr(engine_library, "shipped_folders", lambda: [tmp_path])
    with pytest.raises(tca.CosimError, match="make fmus"):
        engine_library.load_engine.__wrapped__()


def test_a_plan_keeps_what_its_structure_points_to() -> None:
    made = plan.EnginePlan.of(tca.read("step", [*LOOSE, "stop_time=2"]), ["rod.body.E"], [], OUTPUTS)
    assert made.width == 3 + 3 + 3 + 1
    assert made.structure.steps == 2
    assert [made.structure.member[k].name for k in range(2)] == [b"thermal", b"rod"]


@pytest.mark.usefixtures("interruptible")
def test_the_user_stops_a_batch_and_keeps_what_was_done(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt_after_some(done: int) -> None:
        if done > 10:
            signal.raise_signal(signal.SIGINT)

    wait = watched_call.WatchedCall.wait
    monkeypatch.setattr(watched_call, "INTERVAL", 0.01)
    monkeypatch.setattr(watched_call.WatchedCall, "wait", lambda call: wait(call, interrupt_after_some))
    scene, values = tca.read("step", LOOSE), np.linspace(30e3, 45e3, 20_000)
    with pytest.raises(tca.Interrupted, match=r"stopped by the user after \d+ of 20000 runs") as stopped:
        tca.run_batch(scene, {"rod.body.E": values}, threads=2)
    partial = stopped.value.partial
    done = np.array([not text for text in partial.failures])
    assert 10 < done.sum() < 20_000
    assert np.isfinite(partial.outputs[done]).all()
    assert np.isnan(partial.outputs[~done]).all()
    assert set(np.array(partial.failures)[~done]) == {"stopped"}


def test_an_engine_of_another_version_is_named_and_not_called(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its structures are of another size: a call would read past them."""

    class Other:
        _name = "other/tca_engine.so"
        tca_plan_layout = staticmethod(lambda: 8)

    monkeypatch.setattr(binding, "load_engine", Other)
    binding.library.cache_clear()
    try:
        with pytest.raises(CosimError, match=r"other/tca_engine\.so belongs to another version.*make fmus"):
            tca.run_batch(tca.read("step", LOOSE), {"rod.body.E": np.array([37800.0])})
    finally:
        binding.library.cache_clear()
