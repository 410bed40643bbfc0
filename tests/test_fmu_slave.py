"""The FMUs as slaves: states, refused values, order of calls and many instances, through the C interface."""

from __future__ import annotations

import math
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmu_host import SUBJECTS, FMU2Host, Subject, resume, run

# One differentiable output each, with parameters that make it smooth: an undamped rod rings at all its frequencies.
DIFFERENTIABLE = {"probe": ("x", {}), "thermal": ("T[1]", {}), "rod": ("delta[1]", {"body.retardation": 0.005})}
EACH = pytest.mark.parametrize("subject", SUBJECTS, ids=lambda subject: subject.name)


@EACH
def test_simulates_in_fmpy(subject: Subject):
    starts = {name: value for name, (value, _) in subject.inputs.items()}
    result = fmpy.simulate_fmu(str(subject.path), start_values=starts, stop_time=1.0, output_interval=subject.step)
    assert result["time"][-1] == pytest.approx(1.0)
    assert all(np.isfinite(result[name]).all() for name in result.dtype.names)
    assert any(np.ptp(result[name]) > 0.0 for name in result.dtype.names if name != "time")


@EACH
def test_restored_steps_are_bitwise_the_same(subject: Subject):
    with FMU2Host(subject.path) as fmu:
        fmu.start()
        h = subject.step
        fmu.apply(subject.inputs)
        fmu.step(0.0, h)
        state = fmu.getFMUstate()
        rows = []
        for factor in (1.0, 3.0, 1.0):  # the second try leads elsewhere
            fmu.setFMUstate(state)
            fmu.apply({name: (value, factor * slope) for name, (value, slope) in subject.inputs.items()})
            fmu.step(h, h)
            fmu.step(2 * h, h)
            rows.append(fmu.read())
        fmu.freeFMUstate(state)
    assert rows[0] == rows[2]
    assert rows[0] != rows[1]


@EACH
def test_serialised_state_goes_on_in_another_process(subject: Subject):
    h = subject.step
    with FMU2Host(subject.path) as fmu:
        fmu.start()
        fmu.apply(subject.inputs)
        fmu.step(0.0, h)
        state = fmu.serializeFMUstate(fmu.getFMUstate())
        fmu.apply(subject.inputs)
        fmu.step(h, h)
        here = fmu.read()
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        there = pool.submit(resume, subject.path, state, dict(subject.inputs), h, h).result()
    assert here == there


@EACH
def test_damaged_state_is_refused(subject: Subject):
    with FMU2Host(subject.path) as fmu:
        fmu.start()
        state = bytearray(fmu.serializeFMUstate(fmu.getFMUstate()))
        before = fmu.read()
        state[len(state) // 2] ^= 0x40
        with pytest.raises(FMICallException):
            fmu.deSerializeFMUstate(bytes(state))
        assert "damaged" in fmu.messages[-1]
        assert fmu.read() == before


@EACH
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_inputs_refuse_what_is_no_number(subject: Subject, bad: float):
    with FMU2Host(subject.path) as fmu:
        fmu.start()
        before = fmu.read()
        name = next(iter(subject.inputs))
        with pytest.raises(FMICallException):
            fmu.write(name, bad)
        assert name in fmu.messages[-1]
        assert str(bad) in fmu.messages[-1]
        assert fmu.read() == before
        fmu.step(0.0, subject.step)


@EACH
def test_parameters_refuse_what_is_out_of_range(subject: Subject):
    with FMU2Host(subject.path) as fmu:
        for name, value in subject.out_of_range.items():
            with pytest.raises(FMICallException):
                fmu.write(name, value)
            assert name in fmu.messages[-1]
            assert "allowed" in fmu.messages[-1]
        fmu.start()
        fmu.step(0.0, subject.step)


@EACH
def test_calls_out_of_order_are_refused_and_harmless(subject: Subject):
    with FMU2Host(subject.path) as fmu:
        for call in (lambda: fmu.step(0.0, 0.1), fmu.exitInitializationMode, fmu.terminate, fmu.read):
            with pytest.raises(FMICallException):
                call()
            assert "not allowed in state 'instantiated'" in fmu.messages[-1]
        fmu.start()
        fmu.step(0.0, subject.step)
        with pytest.raises(FMICallException):
            fmu.step(0.0, subject.step)
        assert "communication point" in fmu.messages[-1]
        fmu.step(subject.step, subject.step)


@EACH
def test_instances_in_one_process_do_not_touch_each_other(subject: Subject):
    alone = run(subject.path, subject.inputs, subject.step, 3)
    with FMU2Host(subject.path) as a, FMU2Host(subject.path) as b:
        a.start()
        b.start()
        rows = []
        for i in range(3):
            a.apply(subject.inputs)
            b.step(i * subject.step, subject.step)
            a.step(i * subject.step, subject.step)
            b.read()
            rows.append(a.read())
    assert rows == alone


@EACH
def test_reset_goes_back_to_the_start(subject: Subject):
    fresh = run(subject.path, subject.inputs, subject.step, 1)
    with FMU2Host(subject.path) as fmu:
        fmu.start()
        fmu.step(0.0, 2.5 * subject.step)
        fmu.reset()
        fmu.start()
        fmu.apply(subject.inputs)
        fmu.step(0.0, subject.step)
        assert [fmu.read()] == fresh


@EACH
def test_output_derivatives_are_those_of_the_outputs(subject: Subject):
    """Against central differences of the outputs themselves, whose error is of second order in the step."""
    name, parameters = DIFFERENTIABLE[subject.name]
    start, steps = 0.05, np.array([4e-3, 1e-3])
    with FMU2Host(subject.path) as fmu:
        for parameter, value in parameters.items():
            fmu.write(parameter, value)
        fmu.start()
        fmu.apply(subject.inputs)
        fmu.step(0.0, start)
        reference = fmu.references([name])
        state = fmu.getFMUstate()
        errors = []
        for h in steps:
            fmu.setFMUstate(state)
            fmu.step(start, 0.02 - h)
            [before] = fmu.getReal(reference)
            fmu.step(start + 0.02 - h, h)
            [rate] = fmu.getRealOutputDerivatives(reference, [1])
            fmu.step(start + 0.02, h)
            [after] = fmu.getReal(reference)
            errors.append(abs((after - before) / (2 * h) / rate - 1.0))
    assert errors[1] < 1e-3
    assert errors[1] < errors[0] / 8 + 1e-6
