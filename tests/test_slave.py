"""The rod FMU behind the protocol of a subsystem: log into exceptions, rollback bit by bit, handles, folders."""

from __future__ import annotations

import numpy as np
import pytest
from tca_cosim import SubsystemError
from tca_cosim.cosim.subsystem import Subsystem
from tca_cosim.fmi.archive import Archive, find_fmu
from tca_cosim.fmi.slave import Slave

T = ["T[1]", "T[2]", "T[3]"]
DELTA = ["delta[1]", "delta[2]", "delta[3]"]


@pytest.fixture
def archive() -> Archive:
    with Archive(find_fmu("rod.fmu")) as opened:
        yield opened


def started(archive: Archive, **parameters: float) -> Slave:
    slave = Slave(archive, "rod", {"dynamic": True, **parameters}, T, DELTA, recorded=["tip.p[1]", "energy.kinetic"])
    slave.initialise(0.0, np.full(3, 298.15))
    slave.begin()
    return slave


def hot(slave: Slave, kelvin: float) -> None:
    inputs = np.zeros((4, 3))
    inputs[0], inputs[1, 0] = 298.15, kelvin
    slave.set_inputs(inputs)


def test_it_is_a_subsystem(archive: Archive) -> None:
    slave = started(archive)
    assert isinstance(slave, Subsystem)
    assert (slave.can_rollback, slave.takes_polynomials, slave.has_rates) == (True, True, True)
    assert [port.name for port in slave.inputs] == T
    assert {port.unit for port in slave.outputs} == {"m"}
    slave.close()
    slave.close()


def test_restored_steps_are_bitwise_the_same(archive: Archive) -> None:
    slave = started(archive)
    hot(slave, 20.0)
    slave.step(0.0, 0.1)
    state = slave.save()
    seen = []
    for _ in range(2):
        hot(slave, -40.0)
        slave.step(0.1, 0.1)
        seen.append((slave.values(), slave.rates(), slave.record()))
        slave.restore(state)
    for one, other in zip(*seen, strict=True):
        np.testing.assert_array_equal(one, other)
    slave.close()


def test_constant_inputs_come_back_behind_a_restore(archive: Archive) -> None:
    """They are sent once, and again where the FMU has others since."""
    slave = started(archive, dynamic=False)
    cold, warm = np.zeros((4, 3)), np.zeros((4, 3))
    cold[0], warm[0] = 298.15, [318.15, 298.15, 298.15]
    slave.set_inputs(cold)
    slave.step(0.0, 0.1)
    state, seen = slave.save(), []
    for _ in range(2):
        slave.set_inputs(warm)
        slave.step(0.1, 0.1)
        seen.append(slave.values())
        slave.set_inputs(warm)
        slave.restore(state)
    np.testing.assert_array_equal(*seen)
    assert seen[0][0] > 1e-3
    slave.close()


def test_a_handle_is_written_over(archive: Archive) -> None:
    slave = started(archive)
    state = slave.save()
    address = state.value
    hot(slave, 20.0)
    slave.step(0.0, 0.1)
    moved = slave.values()
    assert slave.save(state).value == address
    hot(slave, 20.0)
    slave.step(0.1, 0.1)
    slave.restore(state)
    np.testing.assert_array_equal(slave.values(), moved)
    slave.free(state)
    slave.close()


def test_inputs_are_polynomials_in_time(archive: Archive) -> None:
    """A static rod depends on the end value alone: a slope of 200 K/s over 0.1 s is 20 K at its end."""
    ends = []
    for value, slope in ((298.15, 200.0), (318.15, 0.0)):
        slave = started(archive, dynamic=False)
        inputs = np.zeros((4, 3))
        inputs[0], inputs[0, 0], inputs[1, 0] = 298.15, value, slope
        slave.set_inputs(inputs)
        slave.step(0.0, 0.1)
        ends.append(slave.values())
        slave.close()
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-12)
    assert ends[0][0] > 1e-3


def test_what_the_fmu_says_is_in_the_exception(archive: Archive, capfd: pytest.CaptureFixture[str]) -> None:
    slave = started(archive)
    inputs = np.zeros((4, 3))
    inputs[0] = [np.nan, 300.0, 300.0]
    with pytest.raises(SubsystemError, match=r"rod: setting inputs: .*T\[1\]"):
        slave.set_inputs(inputs)
    slave.close()
    with pytest.raises(SubsystemError, match=r"body\.length"):
        Slave(archive, "rod", {"body.length": -1.0}, T, DELTA)
    assert capfd.readouterr() == ("", "")


def test_many_instances_keep_apart(archive: Archive) -> None:
    slaves = [started(archive) for _ in range(3)]
    for k, slave in enumerate(slaves):
        hot(slave, 10.0 * k)
        slave.step(0.0, 1.0)
    tips = [slave.record()[0] for slave in slaves]
    assert tips[0] != tips[1] != tips[2]
    with pytest.raises(SubsystemError, match="rod"):
        slaves[1].set_inputs(np.full((4, 3), np.nan))
    assert slaves[0].warnings() == slaves[2].warnings() == ()
    for slave in slaves:
        slave.close()


def test_the_folder_goes_with_the_archive(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TCA_COSIM_CACHE", "")  # nothing is kept for other processes
    archive = Archive(find_fmu("rod.fmu"))
    folder = archive.extract()
    assert archive.extract() == folder
    assert (folder / "modelDescription.xml").is_file()
    archive.close()
    assert not folder.exists()
