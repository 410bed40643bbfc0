"""The FMUs as model exchange: the same answers as co-simulation, states that can be set, saved and differentiated."""

from __future__ import annotations

import inspect

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.sundials import CVodeSolver
from fmu_host import SUBJECTS, FMU2Model, Subject

EACH = pytest.mark.parametrize("subject", SUBJECTS, ids=lambda subject: subject.name)
PATHS = {subject.name: subject.path for subject in SUBJECTS}

RELEASE = {"body.retardation": 0.005, "tip_force[1]": 0.002, "order": 2}
FEEDBACK = {"V[2]": 1.5, "V[3]": 3.0, "delta[3]": 1e-3, "T_ambient": 290.0}
FEEDBACK |= {f"tca.{name}[{i}]": value for name, value in (("alpha_T", 0.004), ("beta", 0.1)) for i in (1, 2, 3)}


@pytest.mark.parametrize(
    ("name", "starts", "stop", "tolerance"),
    [
        ("probe", {"force": 1.0, "masses": 3}, 1.0, 1e-8),
        ("rod", RELEASE, 0.2, 1e-9),
        ("rod", {**RELEASE, "closure": 2, "T[1]": 310.0, "delta_guess[1]": 1e-3, "strains": 3}, 0.1, 1e-9),
        ("thermal", {"level": 1, **FEEDBACK}, 3.0, 1e-10),
        ("thermal", {"level": 2, "V[2]": 1.5, "V[3]": 3.0}, 3.0, 1e-10),
        ("thermal", {"level": 2, **FEEDBACK}, 3.0, 1e-10),
    ],
    ids=["probe", "rod-inside", "rod-exchanged", "lumped-feedback", "reduced", "reduced-feedback"],
)
def test_both_interfaces_give_the_same_answer(name: str, starts: dict, stop: float, tolerance: float):
    """CVODE around the model against the FMU's own integrator; Real outputs, scaled by how far they move."""
    description = fmpy.read_model_description(str(PATHS[name]))
    outputs = [v for v in description.modelVariables if v.causality == "output" and v.type == "Real"]
    own = ("reduction.bound", "evaluations")  # sampled where the integrator steps; of the FMU's integrator
    names = [v.name for v in outputs if v.name not in own]
    common = {"stop_time": stop, "output_interval": stop / 10, "output": names}
    if name == "rod":
        starts = {**starts, "tolerance": 1e-9}
    slave = fmpy.simulate_fmu(str(PATHS[name]), start_values=starts, **common)
    how = {"fmi_type": "ModelExchange", "solver": "CVode", "relative_tolerance": tolerance}
    model = fmpy.simulate_fmu(str(PATHS[name]), start_values=starts, **how, **common)
    for output in names:
        size = np.ptp(slave[output])
        assert np.abs(model[output] - slave[output]).max() <= 2e-6 * size + 1e-12, output
    assert max(np.ptp(slave[output]) for output in names) > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
@pytest.mark.parametrize("course", ["jump", "ramp"])
def test_the_default_rod_runs_for_30_s_within_the_steps_that_cvode_allows(course: str, tolerance: float):
    """FMPy's CVode takes at most 500 steps per call, holds inputs from call to call, and starts anew at events only."""
    assert inspect.signature(CVodeSolver.__init__).parameters["maxNumSteps"].default == 500
    times, T = ([0.0, 1.0, 1.0, 30.0], [298.15, 298.15, 340.0, 340.0])
    if course == "ramp":
        times, T = [0.0, 2.0, 12.0, 30.0], [298.15, 298.15, 340.0, 340.0]
    signals = np.array(list(zip(times, T, strict=True)), dtype=[("time", float), ("T[1]", float)])
    moving = {"fmi_type": "ModelExchange", "solver": "CVode", "relative_tolerance": tolerance, "input": signals}
    common = {"stop_time": 30.0, "output_interval": 0.1, "output": ["tip.p[1]"]}
    result = fmpy.simulate_fmu(str(PATHS["rod"]), **moving, **common)
    still = fmpy.simulate_fmu(str(PATHS["rod"]), start_values={"dynamic": False, "T[1]": 340.0}, **common)
    assert result["time"][-1] == 30.0
    assert abs(result["tip.p[1]"][-1] - still["tip.p[1]"][-1]) < 1e-7
    assert np.ptp(result["tip.p[1]"]) > 0.02


@EACH
def test_states_are_set_saved_and_serialised(subject: Subject):
    with FMU2Model(subject.path) as fmu, FMU2Model(subject.path) as other:
        fmu.start()
        fmu.apply(subject.inputs)
        x = fmu.states()
        fmu.put(x + 1e-3 * fmu.used)
        moved, rates, outputs = fmu.states(), fmu.rates(), fmu.read()
        saved = fmu.getFMUstate()
        data = fmu.serializeFMUstate(saved)
        fmu.put(x)
        assert not np.array_equal(fmu.rates(), rates)
        fmu.setFMUstate(saved)
        other.setFMUstate(other.deSerializeFMUstate(data))
        for each in (fmu, other):
            np.testing.assert_array_equal(each.states(), moved)
            np.testing.assert_array_equal(each.rates(), rates)
            assert each.read() == outputs
        fmu.freeFMUstate(saved)


@EACH
def test_directional_derivatives_are_those_of_the_functions(subject: Subject):
    """Along a random direction of all states and inputs, against Richardson's extrapolation of differences taken by the
    host, whose error is of order 6."""
    rng = np.random.default_rng(7)
    with FMU2Model(subject.path) as fmu:
        fmu.start()
        x = fmu.states() + fmu.used * fmu.nominals * rng.uniform(-0.3, 0.3, fmu.used.size)
        inputs = [v for v in fmu.description.modelVariables if v.causality == "input"]
        nominal = np.array([float(v.nominal or 1.0) for v in inputs])
        u = np.array([float(v.start) for v in inputs]) + nominal * 0.1 * rng.uniform(-1, 1, len(inputs))
        dx = fmu.used * fmu.nominals * rng.normal(size=x.size)
        du = nominal * rng.normal(size=u.size)

        def look(s: float) -> np.ndarray:
            fmu.put(x + s * dx)
            fmu.setReal([v.valueReference for v in inputs], u + s * du)
            return np.array([*fmu.rates(), *fmu.read()])

        unknowns = [*fmu.rate_references, *fmu.references(fmu.outputs)]
        known = [*fmu.state_references, *(v.valueReference for v in inputs)]
        look(0.0)
        actual = np.array(fmu.getDirectionalDerivative(unknowns, known, [*dx, *du]))
        h = 4e-3
        d = [(look(h * k) - look(-h * k)) / (2 * h * k) for k in (1, 2, 3)]
        expected = 1.5 * d[0] - 0.6 * d[1] + 0.1 * d[2]
        scale = 1e-3 * np.abs(look(0.0)) + np.abs(expected)
    estimates = ("T_max", "reduction.bound", "spatial_error")  # largest values of something: not smooth
    smooth = [k for k, name in enumerate([*[""] * x.size, *fmu.outputs]) if name not in estimates]
    assert np.abs(actual)[smooth].max() > 0.0
    np.testing.assert_array_less(np.abs(actual - expected)[smooth], 1e-8 * scale[smooth] + 1e-11)


@EACH
def test_what_is_declared_independent_is_independent(subject: Subject):
    with FMU2Model(subject.path) as fmu:
        fmu.start()
        fmu.apply(subject.inputs)
        rng = np.random.default_rng(3)
        fmu.put(fmu.states() + fmu.used * fmu.nominals * rng.uniform(0.1, 0.2, fmu.used.size))
        inputs = [v for v in fmu.description.modelVariables if v.causality == "input"]
        unknowns = [*fmu.description.derivatives, *(o for o in fmu.description.outputs if o.variable.type == "Real")]
        references = [unknown.variable.valueReference for unknown in unknowns]
        states = [row.derivative for row in fmu.derivative_rows]
        for variable in [*states[:: max(1, len(states) // 12)], *inputs]:
            change = fmu.getDirectionalDerivative(references, [variable.valueReference], [1.0])
            acting = {u.variable.name for u, c in zip(unknowns, change, strict=True) if c != 0.0}
            declared = {u.variable.name for u in unknowns if variable in (u.dependencies or [])}
            assert acting <= declared, variable.name


@pytest.mark.parametrize(
    ("name", "choice", "said"),
    [
        ("rod", {"dynamic": False}, "dynamic = true"),
        ("rod", {"method": 5}, "pade_euler"),
        ("thermal", {"level": 3}, "choose reduced or lumped"),
    ],
)
def test_choices_without_states_end_initialisation_with_the_reason(name: str, choice: dict, said: str):
    with FMU2Model(PATHS[name]) as fmu:
        for key, value in choice.items():
            setter = fmu.setBoolean if isinstance(value, bool) else fmu.setInteger
            setter(fmu.references([key]), [value])
        fmu.enterInitializationMode()
        with pytest.raises(FMICallException):
            fmu.exitInitializationMode()
        assert "no model exchange" in fmu.messages[-1]
        assert said in fmu.messages[-1]
