"""Calls of an FMU in any order as a state machine (hypothesis): what FMI 2.0.4 allows in a state is answered, what it
does not allow is refused with fmi2Error and changes nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmu_host import SUBJECTS, FMU2Host, FMU2Model
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test

ERROR = 3
ROD = next(subject for subject in SUBJECTS if subject.name == "rod")
THERMAL = next(subject for subject in SUBJECTS if subject.name == "thermal")
few = settings(
    max_examples=25, stateful_step_count=30, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)


def in_state(*states: str) -> Callable[[Any], Any]:
    return precondition(lambda machine: machine.state in states)


def not_in_state(*states: str) -> Callable[[Any], Any]:
    return precondition(lambda machine: machine.state not in states)


class Calls(RuleBasedStateMachine):
    """One instance; `state` is that of the standard's state machine, `t` the communication point [s]."""

    subject = ROD
    kind: type[FMU2Host] | type[FMU2Model] = FMU2Host
    fmu: Any = None

    @initialize()
    def instantiate(self) -> None:
        self.fmu = self.kind(self.subject.path)
        self.state, self.t = "instantiated", 0.0

    def teardown(self) -> None:
        if self.fmu is not None:
            self.fmu.__exit__()

    def bytes(self) -> bytes:
        state = self.fmu.getFMUstate()
        data = self.fmu.serializeFMUstate(state)
        self.fmu.freeFMUstate(state)
        return data

    def refused(self, call: Callable[[], Any]) -> None:
        before = self.bytes()
        self.fmu.messages.clear()
        with pytest.raises(FMICallException) as failure:
            call()
        assert failure.value.status == ERROR
        assert len(self.fmu.messages) == 1
        assert self.bytes() == before

    # -- life cycle

    @in_state("instantiated")
    @rule()
    def enter_initialization(self) -> None:
        self.fmu.enterInitializationMode()
        self.state = "initialization"

    @in_state("initialization")
    @rule()
    def exit_initialization(self) -> None:
        self.fmu.exitInitializationMode()
        self.state = "running"

    @not_in_state("instantiated")
    @rule()
    def enter_initialization_too_late(self) -> None:
        self.refused(self.fmu.enterInitializationMode)

    @not_in_state("initialization")
    @rule()
    def exit_initialization_out_of_turn(self) -> None:
        self.refused(self.fmu.exitInitializationMode)

    @in_state("running", "terminated")
    @rule()
    def reset(self) -> None:
        self.fmu.reset()
        self.state, self.t = "instantiated", 0.0

    @in_state("running")
    @rule()
    def terminate(self) -> None:
        self.fmu.terminate()
        self.state = "terminated"

    @in_state("instantiated", "initialization", "terminated")
    @rule()
    def terminate_out_of_turn(self) -> None:
        self.refused(self.fmu.terminate)

    # -- values

    @not_in_state("instantiated")
    @rule()
    def read(self) -> None:
        assert all(map(math.isfinite, self.fmu.read()))

    @in_state("instantiated")
    @rule()
    def read_too_early(self) -> None:
        self.refused(self.fmu.read)

    @not_in_state("terminated")
    @rule(share=st.floats(0.0, 1.0))
    def write_inputs(self, share: float) -> None:
        for name, (value, _) in self.subject.inputs.items():
            start = float(self.fmu.variables[name].start)
            self.fmu.write(name, start + share * (value - start))

    @not_in_state("terminated")
    @rule(value=st.sampled_from([math.nan, math.inf, -math.inf]))
    def write_numbers_that_are_none(self, value: float) -> None:
        self.refused(lambda: self.fmu.write(next(iter(self.subject.inputs)), value))

    @rule()
    def write_an_output(self) -> None:
        self.refused(lambda: self.fmu.write(self.fmu.outputs[0], 1.0))

    @rule(reference=st.integers(100_000, 2**31))
    def read_what_is_unknown(self, reference: int) -> None:
        self.refused(lambda: self.fmu.getReal([reference]))

    # -- states

    @rule()
    def save_and_restore(self) -> None:
        before = self.bytes()
        state = self.fmu.getFMUstate()
        self.fmu.setFMUstate(state)
        self.fmu.freeFMUstate(state)
        assert self.bytes() == before

    @rule(where=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7))
    def damaged_bytes(self, where: float, bit: int) -> None:
        data = bytearray(self.bytes())
        data[int(where * len(data))] ^= 1 << bit
        self.refused(lambda: self.fmu.deSerializeFMUstate(bytes(data)))


class Slave(Calls):
    """Co-simulation."""

    @in_state("running")
    @rule(h=st.floats(1e-4, 0.2))
    def step(self, h: float) -> None:
        state = self.fmu.getFMUstate()
        self.fmu.step(self.t, h)
        first = self.bytes()
        self.fmu.setFMUstate(state)
        self.fmu.freeFMUstate(state)
        self.fmu.step(self.t, h)
        assert self.bytes() == first, "a repeated step differs"
        self.t += h

    @in_state("running")
    @rule(h=st.sampled_from([-1.0, math.nan, math.inf]))
    def step_of_no_length(self, h: float) -> None:
        self.refused(lambda: self.fmu.step(self.t, h))

    @not_in_state("running")
    @rule()
    def step_out_of_turn(self) -> None:
        self.refused(lambda: self.fmu.step(self.t, 0.1))


class Model(Calls):
    """Model exchange: `running` is event mode, `continuous` continuous-time mode."""

    kind = FMU2Model

    @in_state("running")
    @rule()
    def enter_continuous_time(self) -> None:
        self.fmu.newDiscreteStates()
        self.fmu.enterContinuousTimeMode()
        self.state = "continuous"

    @in_state("continuous")
    @rule()
    def enter_events(self) -> None:
        self.fmu.enterEventMode()
        self.state = "running"

    @in_state("continuous")
    @rule(seed=st.integers(0, 1000))
    def move(self, seed: int) -> None:
        x = 1e-3 * np.random.default_rng(seed).uniform(-1.0, 1.0, len(self.fmu.derivative_rows))
        self.t += 1e-3
        self.fmu.setTime(self.t)
        self.fmu.put(x)
        assert np.isfinite(self.fmu.rates()).all()
        self.fmu.completedIntegratorStep()

    @not_in_state("continuous")
    @rule()
    def move_out_of_turn(self) -> None:
        self.refused(lambda: self.fmu.put(np.zeros(len(self.fmu.derivative_rows))))

    @in_state("continuous")
    @rule()
    def leave(self) -> None:
        self.fmu.terminate()
        self.state = "terminated"


@pytest.mark.slow
@pytest.mark.parametrize("interface", [Slave, Model])
@pytest.mark.parametrize("subject", [ROD, THERMAL], ids=lambda subject: subject.name)
def test_every_call_is_answered_as_its_state_allows(interface: type[Calls], subject: Any) -> None:
    machine = type(interface.__name__, (interface,), {"subject": subject})
    run_state_machine_as_test(machine, settings=few)
