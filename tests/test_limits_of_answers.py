"""What the two FMUs refuse or say where an answer would be wrong: states that a host's integration cannot have reached,
energy that an undamped rod gains or loses, steps that a grid does not resolve, forged states."""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Iterator

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmu_host import SUBJECTS, FMU2Host, FMU2Model

PATHS = {subject.name: subject.path for subject in SUBJECTS}
DISCARD = 2
UNDAMPED = {"body.retardation": 0.0, "T[1]": 310.0}


def started(name: str, values: dict[str, float]) -> FMU2Host:
    fmu = FMU2Host(PATHS[name])
    for variable, value in values.items():
        if fmu.variables[variable].type == "Real":
            fmu.write(variable, value)
        else:
            fmu.setInteger(fmu.references([variable]), [int(value)])
    fmu.start()
    return fmu


@pytest.mark.parametrize(
    ("name", "heat", "h", "outputs", "largest"),
    [
        ("rod", {"T[1]": (310.0, 0.0)}, 1e-3, ["tip.p[1]", "tip.v[1]"], 1e6),
        ("rod", {"T[1]": (310.0, 0.0)}, 10.0, ["tip.p[1]", "tip.v[1]"], 1e6),
        ("thermal", {"V[1]": (2.0, 0.0)}, 0.1, ["T[1]", "T_max"], 1e6),
    ],
)
def test_outputs_of_a_diverged_integration_are_discarded(name, heat, h, outputs, largest) -> None:
    """Euler's method with steps far too long: neither slopes nor outputs come out of where no motion leads."""
    with FMU2Model(PATHS[name]) as fmu:
        fmu.start()
        fmu.apply(heat)
        x, time = fmu.states(), 0.0
        statuses: list[int] = []
        for _ in range(100):
            try:
                x, time = x + h * fmu.rates(), time + h
            except FMICallException as refused:
                statuses.append(refused.status)
                break
            fmu.setTime(time)
            fmu.put(x)
            fmu.messages.clear()
            try:
                values = fmu.getReal(fmu.references(outputs))
                assert all(abs(value) < largest for value in values)
            except FMICallException as refused:
                statuses.append(refused.status)
        else:
            pytest.fail("the slopes of a diverged integration are not refused")
        with pytest.raises(FMICallException):
            fmu.getReal(fmu.references(outputs))
        assert set(statuses) == {DISCARD}
        assert any("diverged" in message or "rad" in message for message in fmu.messages)


@pytest.mark.parametrize(
    ("choice", "is_said"),
    [({"tolerance": 1e-2}, True), ({"tolerance": 1e-6}, False), ({"tolerance": 1e-2, "body.retardation": 5e-3}, False)],
)
@pytest.mark.slow
def test_an_open_balance_of_energy_is_said(choice: dict[str, float], is_said: bool) -> None:
    with started("rod", {**UNDAMPED, **choice}) as fmu:
        for k in range(150):
            fmu.step(0.01 * k, 0.01)
        assert any("energy" in message for message in fmu.messages) == is_said


def test_the_remedy_for_an_open_balance_is_right_and_the_warning_belongs_to_the_state() -> None:
    with started("rod", {**UNDAMPED, "tolerance": 1e-2}) as fmu:
        early = fmu.getFMUstate()
        for _ in range(2):  # the second time from the restored state
            fmu.messages.clear()
            for k in range(150):
                fmu.step(0.01 * k, 0.01)
            assert sum("tighten tolerance" in message for message in fmu.messages) == 1
            fmu.setFMUstate(early)


@pytest.mark.slow
def test_inputs_that_change_are_no_open_balance() -> None:
    with started("rod", UNDAMPED) as fmu:
        for k in range(60):
            fmu.write("T[1]", 310.0 + 40.0 * (k // 10 % 2))  # work done by the heat
            fmu.apply({"tip_force[1]": (2e-3, 0.1 if k % 20 < 5 else 0.0)})
            fmu.step(0.01 * k, 0.01)
        assert fmu.worst == 0, fmu.messages


@pytest.mark.parametrize(
    ("h", "choice", "is_said"),
    [
        (1e-4, {}, True),  # the tip moves by 9 um, of 3 um in truth and the other way
        (1e-4, {"grid_points": 101}, False),
        (1e-4, {"body.retardation": 5e-3}, False),
        (1e-3, {}, False),
    ],
)
def test_steps_that_the_grid_does_not_resolve_are_said(h: float, choice: dict[str, float], is_said: bool) -> None:
    moved = {}
    for method in (5, 1):  # pade_euler, and the strain polynomials with the same integrator
        with started("rod", {"body.retardation": 0.0, "method": method, "T[1]": 310.0, **choice}) as fmu:
            fmu.step(0.0, h)
            moved[method] = fmu.getReal(fmu.references(["tip.p[1]"]))[0]
            if method == 5:
                assert any("grid interval" in message for message in fmu.messages) == is_said
    assert (abs(moved[5] - moved[1]) > 0.2 * abs(moved[1])) == is_said


def checksum(data: bytes) -> int:
    value = 0xCBF29CE484222325
    for byte in data:
        value = ((value ^ byte) * 0x100000001B3) & (2**64 - 1)
    return value


HEADER_WORDS = 15  # of a serialised state in front of the parameters


def forgeries(fmu: FMU2Host, data: bytes) -> Iterator[tuple[str, bytes]]:
    """The state with one parameter replaced, in its value and in what the model was built with, checksum made right."""
    parameters = [v for v in fmu.description.modelVariables if v.causality == "parameter"]
    inputs = [v for v in fmu.description.modelVariables if v.causality == "input"]
    for index, variable in enumerate(parameters):
        at = (8 * (HEADER_WORDS + index), 8 * (HEADER_WORDS + len(parameters) + 4 * len(inputs) + 1 + index))
        for value in (1e9, math.nan, -1.0, float(variable.min or 0.0), float(variable.max or 1.0)):
            forged = bytearray(data)
            for position in at:
                forged[position : position + 8] = struct.pack("d", value)
            forged[-8:] = struct.pack("Q", checksum(forged[:-8]))
            yield f"{variable.name} = {value}", bytes(forged)


def test_forged_parameters_in_a_state_are_refused_or_run() -> None:
    """A state whose checksum fits, but whose parameters no call would have accepted, or do not fit its memory."""
    child = os.fork()
    if child == 0:  # a crash is the child's
        code = 1
        try:
            with started("rod", {"order": 4}) as fmu:
                fmu.step(0.0, 1e-3)
                kept = fmu.getFMUstate()
                data = fmu.serializeFMUstate(kept)
                order = 8 * (
                    HEADER_WORDS
                    + [v.name for v in fmu.description.modelVariables if v.causality == "parameter"].index("order")
                )
                assert struct.unpack("d", data[order : order + 8])[0] == 4.0
                refused = 0
                for what, forged in forgeries(fmu, data):
                    try:
                        fmu.setFMUstate(fmu.deSerializeFMUstate(forged))
                        fmu.step(1e-3, 1e-4)
                        assert np.isfinite(fmu.read()).all(), what
                    except FMICallException:
                        refused += 1
                    fmu.setFMUstate(kept)
                    fmu.step(1e-3, 1e-4)
                code = 0 if refused > 100 else 2
        finally:
            os._exit(code)
    status = os.waitpid(child, 0)[1]
    assert os.waitstatus_to_exitcode(status) == 0


@pytest.mark.parametrize(
    ("values", "inputs", "words"),
    [
        ({"tca.wire_diameter": 1.1e-3}, {}, "tca.wire_diameter[1] = 0.0011 m"),
        ({"tca.coils[2]": 60.0}, {}, "tca.wire_diameter[2] = 0.00065 m"),
        ({"tca.wire_diameter": 0.9e-3}, {}, ""),  # 1.05 mm is the width of the coils, 1.01 mm their distance
        ({"tip_body.inertia[1]": 1e-6}, {}, "tip_body.mass = 0"),
        ({"tip_body.mass": 1e-3, "tip_body.inertia[1]": 1e-6}, {}, "at most the sum of the other two"),
        ({"tip_body.mass": 1e-3, "tip_body.inertia[1]": 1e-6, "tip_body.inertia[2]": 1e-6}, {}, ""),
        ({"dynamic": 0}, {"tip_force[3]": 60.0}, "is straight at 0.09 m"),  # 0.13 m of wire on 0.04 m of body
        ({"dynamic": 0}, {"tip_force[3]": 1.0}, ""),
        ({"closure": 2}, {"delta_guess[3]": -0.0157}, "TCA 3 is shorter by delta = -0.0157 m"),
        ({"closure": 2}, {"delta_guess[3]": -0.0155}, ""),  # 37.5 coils of 0.65 mm are 24.4 mm of 40
        ({"closure": 2, "tca.law": 2}, {"delta_guess[3]": -0.0157}, ""),
    ],
)
def test_what_no_coil_and_no_body_can_be_is_said(values: dict, inputs: dict, words: str) -> None:
    for again in (False, True):
        with FMU2Host(PATHS["rod"]) as fmu:
            if again:
                fmu.start()
                fmu.reset()
                fmu.messages.clear()
                fmu.worst = 0
            for name, value in values.items():
                kind = {"Real": fmu.setReal, "Boolean": fmu.setBoolean}.get(fmu.variables[name].type, fmu.setInteger)
                kind(fmu.references([name]), [value])
            fmu.enterInitializationMode()
            for name, value in inputs.items():
                fmu.write(name, value)
            fmu.exitInitializationMode()
            fmu.read()
            assert fmu.worst == (1 if words else 0), fmu.messages
            assert not words or words in " ".join(fmu.messages)


STIFF = [
    # level, tca.alpha_T [1/K], V [V], end [s]: a temperature changes the power in 1e-4 to 1e-6 s
    (1, 1.0, 100.0, 30.0),
    (2, 0.1, 20.0, 30.0),
    (2, 1.0, 3000.0, 1.0),
]


@pytest.mark.parametrize(("level", "alpha", "voltage", "end"), STIFF)
def test_stiff_feedback_is_right_in_one_long_step(level: int, alpha: float, voltage: float, end: float) -> None:
    """Against an implicit method of order 5 on the rates of the model exchange instance."""
    from scipy.integrate import solve_ivp

    values = {"level": level, **{f"tca.alpha_T[{i}]": alpha for i in (1, 2, 3)}}
    heat = {"V[1]": (voltage, 0.0), "V[2]": (voltage / 2, 0.0)}
    temperatures = [f"T[{i}]" for i in (1, 2, 3)]
    with started("thermal", values) as fmu:
        fmu.apply(heat)
        fmu.step(0.0, end)
        actual = np.array(fmu.getReal(fmu.references(temperatures)))
    with FMU2Model(PATHS["thermal"]) as model:
        for name, value in values.items():
            setter = model.setReal if model.variables[name].type == "Real" else model.setInteger
            setter(model.references([name]), [value])
        model.start()
        model.apply(heat)

        def rates(_: float, x: np.ndarray) -> np.ndarray:
            model.put(x)
            return model.rates()

        solution = solve_ivp(rates, (0.0, end), model.states(), method="Radau", rtol=1e-7, atol=1e-9)
        model.put(solution.y[:, -1])
        expected = np.array(model.getReal(model.references(temperatures)))
    assert np.abs(actual - expected).max() < 1e-4 * np.abs(expected - 298.15).max()


def test_a_small_resistance_that_heat_raises_is_no_blow_up() -> None:
    """2.5 % of tca.R are left by the displacement, but the heat raises them: shorter steps, as the message says."""
    values = {**{f"tca.alpha_T[{i}]": 0.01 for i in (1, 2, 3)}, **{f"tca.beta[{i}]": 1e3 for i in (1, 2, 3)}}
    with started("thermal", values) as fmu:
        fmu.apply({"V[1]": (50.0, 0.0), "delta[1]": (-3.9e-5, 0.0)})
        start = fmu.getFMUstate()
        with pytest.raises(FMICallException) as refused:
            fmu.step(0.0, 1e5)
        assert refused.value.status == DISCARD
        assert "blow-up" not in fmu.messages[-1]
        assert "take shorter steps" in fmu.messages[-1]
        fmu.setFMUstate(start)
        fmu.step(0.0, 30.0)
        assert fmu.getReal(fmu.references(["T[1]"]))[0] > 500.0
