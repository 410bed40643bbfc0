"""What an FMU is told and when: parameters, start and stop time, tolerance, whether earlier states come back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from fmu_maker import make_fmu, real
from tca_cosim import SubsystemError
from tca_cosim.fmi.archive import Archive
from tca_cosim.fmi.slave import Slave

Open = Callable[..., Slave]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Open]:
    """Makes an FMU and opens one instance of it, initialised and begun."""
    slaves, archives = [], []

    def open_fmu(variables: list, outputs: list[str], inputs: tuple[str, ...] = (), **more: object) -> Slave:
        setting = {key: more.pop(key) for key in ("parameters", "start", "stop", "tolerance") if key in more}
        archive = Archive(make_fmu(tmp_path / "made.fmu", variables, **more))
        archives.append(archive)
        slave = Slave(archive, "made", setting.pop("parameters", {}), inputs, outputs, outputs, **setting)
        slaves.append(slave)
        slave.initialise(setting.get("start", 0.0), np.ones(len(inputs)))
        slave.begin()
        return slave

    yield open_fmu
    for slave in slaves:
        slave.close()
    for archive in archives:
        archive.close()


def test_parameters_survive_defaults_that_are_loaded_at_setup(opened: Open) -> None:
    """Some FMUs fill their parameters in fmi2SetupExperiment; what a scene sets comes behind."""
    slave = opened(
        [real("k", "parameter", start=1.0), real("y")],
        ["y"],
        parameters={"k": 3.0},
        setup="real[0] = 1.0;",
        enter="memory[0] = real[0];",
        output="real[1] = memory[0];",
    )
    assert slave.values() == 3.0


def test_inputs_are_there_when_initialisation_begins(opened: Open) -> None:
    slave = opened(
        [real("u", "input", start=0.0), real("y")],
        ["y"],
        ("u",),
        enter="memory[0] = real[0];",
        output="real[1] = memory[0];",
    )
    assert slave.values() == 1.0


@pytest.mark.parametrize("given", [{"start": 2.5, "stop": 7.0, "tolerance": 1e-5}, {}])
def test_the_experiment_is_handed_over(opened: Open, given: dict[str, float]) -> None:
    slave = opened(
        [real("start"), real("stop"), real("tolerance")],
        ["start", "stop", "tolerance"],
        output="real[0] = m->start_time; real[1] = fmin(m->stop_time, 1e9); real[2] = m->tolerance;",
        **given,
    )
    assert slave.values().tolist() == [given.get("start", 0.0), given.get("stop", 1e9), given.get("tolerance", 0.0)]


def test_the_fmu_knows_exactly_when_no_earlier_state_comes_back(opened: Open) -> None:
    """noSetFMUStatePriorToCurrentPoint is false only where a state from before the step's start is still held."""
    slave = opened([real("flag")], ["flag"], step="memory[0] = no_state_before;", output="real[0] = memory[0];")

    def no_earlier_state(time: float) -> bool:
        slave.step(time, 0.5)
        return bool(slave.values()[0])

    assert no_earlier_state(0.0)
    state = slave.save()
    assert no_earlier_state(0.5)  # back to where the step starts is not before it
    slave.restore(state)
    assert no_earlier_state(0.5)
    assert not no_earlier_state(1.0)
    slave.restore(state)
    assert no_earlier_state(0.5)
    state = slave.save(state)  # written over: the older one is gone
    assert no_earlier_state(1.0)
    assert not no_earlier_state(1.5)
    slave.free(state)
    assert no_earlier_state(2.0)


def test_without_states_nothing_comes_back(opened: Open) -> None:
    slave = opened(
        [real("flag")], ["flag"], step="memory[0] = no_state_before;", output="real[0] = memory[0];", state=False
    )
    slave.step(0.0, 1.0)
    assert slave.values() == 1.0
    assert not slave.can_rollback


def test_states_that_are_promised_but_not_there_are_done_without(opened: Open) -> None:
    slave = opened([real("y")], ["y"], save="return fmi2Error;", output="real[0] = m->time;")
    assert not slave.can_rollback
    assert "states cannot be saved" in str(slave.warnings()[0])
    slave.step(0.0, 1.0)
    assert slave.values() == 1.0


@pytest.mark.parametrize("bad", ["0.0 / 0.0", "1.0 / 0.0", "-1.0 / 0.0"])
def test_outputs_that_are_not_finite_are_not_passed_on(opened: Open, bad: str) -> None:
    slave = opened([real("y"), real("z")], ["y", "z"], output=f"real[1] = t > 0.7 ? {bad} : 2.0;")
    slave.step(0.0, 0.5)
    assert slave.values().tolist() == [0.0, 2.0]
    slave.step(0.5, 0.5)
    with pytest.raises(SubsystemError, match=r"made: output z is -?(nan|inf) at t = 1 s"):
        slave.values()


def test_time_derivatives_that_are_not_finite_are_not_passed_on(opened: Open) -> None:
    slave = opened(
        [real("y"), real("z")],
        ["y", "z"],
        rates="rate[0] = 1.0 / (t - 0.5);",
        co_simulation={"maxOutputDerivativeOrder": 1},
    )
    assert slave.rates().tolist() == [-2.0, 0.0]
    slave.step(0.0, 0.5)
    with pytest.raises(SubsystemError, match=r"made: time derivative of y is inf at t = 0.5 s"):
        slave.rates()


@pytest.mark.parametrize("nominal", ["INF", "NaN"])
def test_nominals_that_are_not_finite_are_named(opened: Open, nominal: str) -> None:
    with pytest.raises(SubsystemError, match=r"the nominal value of y is (inf|nan)"):
        opened([real("y", nominal=nominal)], ["y"])


def test_warnings_are_counted_and_timed(opened: Open) -> None:
    slave = opened(
        [real("y")],
        ["y"],
        step='if (t > 0.2) { LOG(fmi2Warning, "tolerance missed in step %d", m->steps); return fmi2Warning; }',
    )
    for k in range(4):
        slave.step(0.25 * k, 0.25)
    [warning] = slave.warnings()
    assert (warning.member, warning.count, warning.time) == ("made", 3, 0.25)
    assert warning.text == "tolerance missed in step 1"


def test_a_warning_without_words_is_one_too(opened: Open) -> None:
    slave = opened([real("y")], ["y"], step="return fmi2Warning;")
    slave.step(0.0, 1.0)
    assert "answered fmi2Warning and logged nothing" in str(slave.warnings()[0])


@pytest.mark.parametrize("status", ["fmi2Error", "fmi2Discard"])
@pytest.mark.parametrize("name", ["m->name", "NULL"])
def test_messages_without_environment_find_their_instance(opened: Open, name: str, status: str) -> None:
    """Also among others that run in the same process."""
    other = opened([real("y")], ["y"])
    step = f'm->callbacks->logger(NULL, {name}, {status}, NULL, "no way"); return {status};'
    slave = opened([real("y")], ["y"], step=step)
    other.step(0.0, 1.0)
    with pytest.raises(SubsystemError, match=r"made: step from t = 0 s by 1 s: no way"):
        slave.step(0.0, 1.0)
    assert not other.warnings()


def test_warnings_without_name_are_those_of_the_call_that_answers_so(opened: Open) -> None:
    step = 'm->callbacks->logger(NULL, NULL, fmi2Warning, NULL, "too hot"); return fmi2Warning;'
    slave, other = opened([real("y")], ["y"], step=step), opened([real("y")], ["y"])
    slave.step(0.0, 1.0)
    other.step(0.0, 1.0)
    assert [warning.text for warning in slave.warnings()] == ["too hot"]
    assert not other.warnings()
