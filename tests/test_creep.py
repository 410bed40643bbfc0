"""Creep of measured TCAs in FMUs and scenes: closed form, saved states, derivatives, and what it is refused with."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import fmpy
import fmpy.validation
import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim import scene as scenes
from tca_cosim.cli import app
from tca_cosim.fmi.archive import Archive, find_fmu
from tca_cosim.verification import reference
from tca_cosim.visualization.charts import charts
from typer.testing import CliRunner

K, J, TAU = 20.0, 0.08, 4.0  # N/m, m/N, s
E, LENGTH, RADIUS = 37.8e3, 0.04, 5e-3
FORCE = 0.2  # N
HANGING: dict[str, Any] = {
    "stop_time": 8.0,
    "fmus": {"rod": "rod.fmu"},
    "connections": [],
    "body": {"tcas": 1, "creep": True},
    "rod": {
        "dynamic": False,
        "start_at_equilibrium": True,
        "strains": "extensible",
        "order": 0,
        "tca.offset": 0.0,
        "tca.law": "measured",
        "tca.stiffness": K,
        "tca.stroke": 0.0,
        "tca.creep_compliance": J,
        "tca.creep_time": TAU,
        "tip_force": [0.0, 0.0, FORCE],
    },
    "coupling": {"macro_step": 0.5},
}


def body_stiffness() -> float:
    return E * math.pi * RADIUS**2 / LENGTH


def crept(t: np.ndarray) -> np.ndarray:
    """K_b delta + k (delta - z) = F and tau dz/dt = J k (delta - z) - z, solved."""
    k_b = body_stiffness()
    rate = (1.0 + J * K * k_b / (k_b + K)) / TAU
    return J * K * FORCE / (k_b + K) / (TAU * rate) * -np.expm1(-rate * t)


def test_a_constant_load_creeps_exponentially() -> None:
    result = tca.run(HANGING)
    z = crept(result["time"].to_numpy())
    np.testing.assert_allclose(result["rod.creep"][:, 0], z, atol=2e-6 * z[-1])
    np.testing.assert_allclose(result["rod.delta"][:, 0], (FORCE + K * z) / (body_stiffness() + K), rtol=1e-6)
    assert (np.diff(result["rod.energy.dissipated"]) > 0.0).all()
    assert "Creep of the TCAs" in [chart.title for chart in charts(result)]
    coarse = tca.run({**HANGING, "coupling": {"macro_step": 4.0}})
    np.testing.assert_allclose(coarse["rod.creep"][-1], result["rod.creep"][-1], rtol=2e-6)


def test_a_jump_of_the_load_is_followed() -> None:
    rod = {**HANGING["rod"], "tip_force": [0.0, 0.0, {"steps": [[0.0, FORCE], [3.0, 0.0]]}]}
    result = tca.run({**HANGING, "rod": rod})
    k_b = body_stiffness()
    rate = (1.0 + J * K * k_b / (k_b + K)) / TAU
    z = float(crept(np.array(3.0))) * math.exp(-5.0 * rate)
    assert float(result["rod.creep"][-1, 0]) == pytest.approx(z, rel=1e-5)


def test_saved_states_hold_the_creep() -> None:
    with tca.Simulation(HANGING) as simulation:
        simulation.step(2.0)
        kept = simulation.save()
        simulation.step(4.0)
        after = float(simulation["rod.creep[1]"])
        simulation.restore(kept)
        assert float(simulation["rod.creep[1]"]) < after
        simulation.step(4.0)
        assert float(simulation["rod.creep[1]"]) == after


@pytest.mark.slow
def test_an_exported_fmu_creeps_alone_and_differentiates(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["export", str(tmp_path), "--tcas", "1", "--creep", "--fmu", "rod"])
    assert done.exit_code == 0, done.output
    path = tmp_path / "rod.fmu"
    assert fmpy.validation.validate_fmu(str(path)) == []
    names = {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}
    assert {"tca.creep_compliance[1]", "tca.creep_time[1]", "tca.creep_activation[1]", "creep[1]"} <= set(names)
    assert not any("creep" in name for name in Archive(find_fmu("rod.fmu")).variables)
    scene = scenes.read(HANGING)
    member = scene.member("rod")
    starts = {**member.parameters, **{n: s.polynomial(0.0, 1e-9)[0] for n, s in member.signals.items()}}
    slave = fmpy.instantiate_fmu(fmpy.extract(str(path)), fmpy.read_model_description(str(path)), "CoSimulation")
    try:
        slave.setupExperiment(startTime=0.0)
        fmpy.simulation.apply_start_values(
            slave, fmpy.read_model_description(str(path)), starts, settable=lambda v: True
        )
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        for k in range(4):
            slave.doStep(0.5 * k, 0.5)
        assert slave.getReal([names["creep[1]"]])[0] == pytest.approx(float(crept(np.array(2.0))), rel=1e-5)
        compliance = slave.getDirectionalDerivative([names["delta[1]"]], [names["tip_force[3]"]], [1.0])[0]
        assert compliance == pytest.approx(1.0 / (body_stiffness() + K), rel=1e-8)  # at once: the creep stays
    finally:
        slave.terminate()
        slave.freeInstance()


@pytest.mark.parametrize(
    ("changes", "remedy", "change_that_helps"),
    [
        ({"dynamic": True}, "needs dynamic = false", {"dynamic": False}),
        ({"tca.law": "wire"}, "set it to measured", {"tca.law": "measured"}),
        ({"closure": "exchanged"}, "closure = inside", {"closure": "inside"}),
        ({"tca.contact": "bonded"}, "tca.contact = sliding", {"tca.contact": "sliding"}),
        ({"dynamic": True}, "or the compliance to 0", {"tca.creep_compliance": 0.0}),
    ],
)
def test_what_it_does_not_cover_is_refused_with_a_remedy(
    changes: dict[str, Any], remedy: str, change_that_helps: dict[str, Any]
) -> None:
    short = {**HANGING, "stop_time": 0.5, "rod": {**HANGING["rod"], **changes}}
    with pytest.raises(tca.CosimError, match=re.escape(remedy)):
        tca.run(short)
    tca.run({**short, "rod": {**short["rod"], **change_that_helps}})


@pytest.mark.parametrize("settings", [{"dynamic": False}, {"dynamic": True}, {"dynamic": True, "method": "pade_euler"}])
def test_what_does_not_creep_has_none(settings: dict[str, Any]) -> None:
    """An FMU with the option whose TCAs have no compliance is the FMU without it."""
    table = {"stop_time": 0.1, "body": {"creep": True}, "rod": {"closure": "inside", **settings}}
    result = tca.run({**table, "thermal": {"V": [3.0, 0.0, 0.0]}, "coupling": {"macro_step": 0.05}})
    plain = tca.run({**table, "body": {}, "thermal": {"V": [3.0, 0.0, 0.0]}, "coupling": {"macro_step": 0.05}})
    assert not result["rod.creep"].any()
    np.testing.assert_array_equal(result["rod.tip.p"], plain["rod.tip.p"])


def test_creep_without_its_option_and_in_the_reference() -> None:
    without = {**HANGING, "body": {"tcas": 1}}
    with pytest.raises(tca.SceneError, match=r"tca\.creep_compliance"):
        tca.read(without)
    with pytest.raises(tca.SceneError, match="give true or false"):
        tca.read({**HANGING, "body": {"tcas": 1, "creep": 1}})
    with pytest.raises(tca.SceneError, match="a TCA that creeps"):
        reference.run(tca.read(HANGING))


@pytest.mark.parametrize(
    ("change", "coupling"),
    [
        ({"tca.creep_time": 1e-3}, {}),
        ({"tca.creep_compliance": 0.0}, {}),
        ({}, {"macro_step": 1e-5}),
    ],
)
def test_creep_too_fast_to_be_followed_says_what_helps(change: dict[str, Any], coupling: dict[str, Any]) -> None:
    """A retardation time of 1e-12 s, where the shortest step of creep is 1e-10 of a macro step of half a second."""
    rod = {**HANGING["rod"], "tca.creep_time": 1e-12}
    table = {**HANGING, "stop_time": 0.5, "coupling": {"macro_step": 0.5, "halvings": 0}}
    with pytest.raises(tca.CouplingError, match=r"too fast to be followed; give it more time \(tca\.creep_time"):
        tca.run({**table, "rod": rod})
    short = {"stop_time": 3e-5} if coupling else {}
    result = tca.run({**table, **short, "rod": {**rod, **change}, "coupling": {**table["coupling"], **coupling}})
    limit = J * K * FORCE / (body_stiffness() + K) / (1.0 + J * K * body_stiffness() / (body_stiffness() + K))
    expected = 0.0 if change.get("tca.creep_compliance") == 0.0 else limit
    assert float(result["rod.creep"][-1, 0]) == pytest.approx(expected, rel=1e-5)
