"""The monolith against the co-simulation, whose error then is that of the coupling; natural frequencies against known
ones."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tca_cosim import SceneError, SubsystemError, read, run
from tca_cosim.verification import monolith
from test_cli import tca

# A damped rod whose TCAs are heated smoothly; tolerances below what the coupling is asked for.
DAMPED = (
    "stop_time=0.5",
    "rod.dynamic=true",
    "rod.closure=inside",
    "rod.body.retardation=0.02",
    "rod.order=1",
    "rod.tolerance=1e-11",
    "thermal.V={sine={amplitude=3,period=2}}",
)
FEEDBACK = ("thermal.tca.beta=5.0", "thermal.tca.alpha_T=0.004", "coupling.tolerance=1e-12")


def gap(overrides: tuple[str, ...], step: float) -> float:
    """Largest difference of the displacements [m] at multiples of 0.1 s."""
    scene = read("step", [*DAMPED, *overrides, f"coupling.macro_step={step}"])
    coupled = run(scene)
    times = np.linspace(0.0, 0.5, 6)
    alone = monolith.solve_monolith(scene, 1e-12, times)
    nearest = [int(np.abs(coupled["time"].to_numpy() - t).argmin()) for t in times]
    return float(np.abs(coupled["rod.delta"].to_numpy()[nearest] - alone["rod.delta"].to_numpy()).max())


@pytest.mark.parametrize("loop", [(), FEEDBACK], ids=["one-way", "two-way"])
@pytest.mark.parametrize(("exchange", "order", "step"), [("linear", 2, 1 / 320), ("hermite", 4, 1 / 160)])
def test_the_coupling_error_falls_at_its_order(exchange: str, order: int, step: float, loop: tuple[str, ...]) -> None:
    settings = (f"coupling.exchange={exchange}", f"coupling.waveform={exchange}", *loop)
    errors = [gap(settings, step) for step in (2 * step, step)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.45)
    assert errors[1] < {2: 1e-8, 4: 1e-11}[order]


@pytest.mark.parametrize("scene", ["step", "switch", "sine"])
def test_the_scenes_of_the_paper_agree(scene: str) -> None:
    """The master closes the TCA loop by iteration, the monolith inside the rod; the switch is an event at 15 s."""
    described = read(scene, ["stop_time=16", "coupling.macro_step=0.2"])
    coupled = run(described)
    alone = monolith.solve_monolith(described, times=coupled["time"].to_numpy())
    assert set(alone.data_vars) == set(coupled.data_vars)
    assert float(np.abs(coupled["rod.delta"] - alone["rod.delta"]).max()) < 1e-8
    assert float(np.abs(coupled["rod.tip.p"] - alone["rod.tip.p"]).max()) < 1e-7
    # A sine of the voltage is a cubic per macro step to the co-simulation.
    assert float(np.abs(coupled["thermal.T"] - alone["thermal.T"]).max()) < (1e-5 if scene == "sine" else 1e-7)
    np.testing.assert_allclose(coupled["thermal.V"], alone["thermal.V"], atol=1e-12)


@pytest.mark.parametrize(
    ("scene", "stop", "apart"),
    [
        ("drop", 0.2, 1e-7),
        ("tap", 0.1, 1e-6),
        ("pulse", 0.6, 1e-7),
        ("hang", 60, 1e-7),
        ("load", 12, 1e-7),
        ("push", 20, 1e-7),
    ],
)
def test_scenes_with_loads_and_impulses_agree(scene: str, stop: float, apart: float) -> None:
    """Largest distance of the tips [m]. The blow of `tap` is a cubic per macro step to the co-simulation."""
    described = read(scene, [f"stop_time={stop}"])
    coupled = run(described)
    alone = monolith.solve_monolith(described, 1e-9, coupled["time"].to_numpy())
    assert float(np.abs(coupled["rod.tip.p"] - alone["rod.tip.p"]).max()) < apart
    assert float(np.ptp(coupled["rod.tip.p"].to_numpy(), axis=0).max()) > 1e-4  # something happens


def test_quasi_static_feedback_is_solved_within_every_evaluation() -> None:
    """A rod at rest has no rates, so its waveform is the linear one: order 2."""
    times = np.linspace(0.0, 1.0, 6)
    errors = []
    for step in (0.05, 0.025):
        scene = read("step", ["stop_time=1", "rod.closure=inside", f"coupling.macro_step={step}", *FEEDBACK])
        coupled = run(scene)
        alone = monolith.solve_monolith(scene, times=times)["rod.delta"].to_numpy()
        nearest = [int(np.abs(coupled["time"].to_numpy() - t).argmin()) for t in times]
        errors.append(np.abs(coupled["rod.delta"].to_numpy()[nearest] - alone).max())
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.3)
    assert errors[1] < 1e-6
    without = monolith.solve_monolith(read("step", ["stop_time=1"]), times=times)["rod.delta"].to_numpy()
    assert np.abs(without - alone).max() > 1e-5


def test_what_has_no_states_says_so() -> None:
    with pytest.raises(SubsystemError, match="pade_euler"):
        monolith.solve_monolith(read("step", ["rod.dynamic=true", "rod.method=pade_euler"]))


def test_an_algebraic_loop_is_refused() -> None:
    wires = "connections=['thermal.T -> rod.T', 'rod.delta -> thermal.delta', 'thermal.P[1] -> thermal.V[1]']"
    with pytest.raises(SceneError, match=r"units differ|depend on each other"):
        monolith.solve_monolith(read("step", [wires]))


# -- modes
# -------------------------------------------------------------------------------------------------------------------

BARE = (
    "rod.dynamic=true",
    "rod.closure=inside",
    "rod.tca.law=measured",
    "rod.tca.stiffness=0",
    "rod.body.rho=1070",
    f"rod.body.shear_factor={27 / 28}",
    "rod.body.retardation=0",
    "rod.order=7",
)


def nearest(actual: monolith.Modes, known: float) -> monolith.Mode:
    return min(actual.modes, key=lambda mode: abs(mode.frequency - known))


def test_frequencies_of_the_bare_rod() -> None:
    """Timoshenko's beam: bending 1 to 3, axial, torsion."""
    actual = monolith.natural_modes(read("step", BARE))
    for known in (5.0149, 26.471, 62.150, 37.1479, 21.4473):
        assert nearest(actual, known).frequency == pytest.approx(known, rel=1e-4)
    assert abs(actual.modes[0].damping) < 1e-9


def test_frequencies_with_cold_tcas_wherever_the_loop_is_closed() -> None:
    """The generalised eigenproblem of the rod's own mass and stiffness gives 6.35289 Hz."""
    undamped = ("rod.order=7", "rod.body.retardation=0")
    inside = monolith.natural_modes(read("step", ["rod.dynamic=true", "rod.closure=inside", *undamped]))
    quasi_static = monolith.natural_modes(read("step", undamped))
    for actual in (inside, quasi_static):
        assert [mode.frequency for mode in actual.modes[:2]] == pytest.approx([6.35289, 6.35289], rel=1e-6)


def test_damping_ratio_of_a_kelvin_voigt_body() -> None:
    """retardation * omega / 2, for modes of the body alone."""
    actual = monolith.natural_modes(read("step", [*BARE, "rod.body.retardation=0.001"]))
    for known in (5.0149, 26.471):
        mode = nearest(actual, known)
        assert mode.damping == pytest.approx(0.0005 * 2 * math.pi * known, rel=1e-4)
        assert mode.frequency == pytest.approx(known, rel=1e-4)


def test_a_later_time_is_that_of_the_moving_system() -> None:
    hot = monolith.natural_modes(read("step", ["rod.order=3"]), 20.0)
    cold = monolith.natural_modes(read("step", ["rod.order=3"]))
    split = [hot.modes[1].frequency / hot.modes[0].frequency, cold.modes[1].frequency / cold.modes[0].frequency]
    assert split[0] > 1.001 > split[1]  # the bent rod is stiffer in one direction
    moving = monolith.natural_modes(read("step", [*DAMPED]), 0.2)
    assert moving.growing < 1e-6


def test_an_upright_rod_beyond_its_buckling_load_grows() -> None:
    weight = 7.837 * 1.8555e-5 / (1070 * math.pi * 25e-6 * 0.04**3)  # gravity of the known load [m/s2]
    slender = ("rod.strains=bending", "rod.order=5")
    for share, grows in ((0.99, False), (1.01, True)):
        actual = monolith.natural_modes(read("step", [*BARE, *slender, f"rod.gravity=[0, 0, {-share * weight}]"]))
        assert (actual.growing > 0.1) == grows


def test_a_quasi_static_rod_is_linearised_about_the_equilibrium_that_it_has_reached() -> None:
    """Buckled to one side by a force that is gone by then: the straight rod, also an equilibrium, would be unstable."""
    weight = 7.837 * 1.8555e-5 / (1070 * math.pi * 25e-6 * 0.04**3)
    push = "rod.tip_force[1]={ramps=[[0, 0.01], [1, 0.01], [2, 0]]}"
    slender = ("rod.strains=bending", "rod.order=5", f"rod.gravity=[0, 0, {-1.3 * weight}]")
    buckled = read("step", [*BARE, *slender, "rod.dynamic=false", "thermal.V=0", push])
    actual = monolith.natural_modes(buckled, 3.0)
    assert actual.offsets["rod"] < 1e-6
    assert actual.growing <= 0.0
    assert actual.remarks == []
    straight = read("step", [*BARE, *slender, "thermal.V=0"])
    fallen = monolith.natural_modes(straight)
    assert fallen.growing > 1.0
    assert "the state is unstable" in fallen.remarks[-1]


def test_a_state_that_is_no_equilibrium_is_said() -> None:
    """A hot rod is handed over as it is; a rod on its way down is not at rest."""
    hot = monolith.natural_modes(read("step", ["rod.order=3"]), 20.0)
    assert hot.offsets["rod"] < 1e-6
    assert [remark.split(" is not")[0] for remark in hot.remarks] == ["thermal"]  # still heating up
    falling = monolith.natural_modes(read("drop"), 0.05)
    assert falling.offsets["rod"] > 1.0
    assert "rod is not at equilibrium" in falling.remarks[0]


# -- commands
# -------------------------------------------------------------------------------------------------------------------


def test_commands(tmp_path: Path) -> None:
    short = ["--set", "stop_time=0.4", "--out", "."]
    assert tca("run", "step", *short, folder=tmp_path).returncode == 0
    done = tca("monolith", "step", *short, "--against", "step.nc", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "step.monolith.nc").is_file()
    assert "rod.delta" in done.stdout
    listed = tca("modes", "step", "--count", "2", folder=tmp_path)
    assert listed.returncode == 0, listed.stderr
    assert "6.3639" in listed.stdout
