"""The coupling against known answers: limits of stability and contraction, orders."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tca_cosim import CouplingError
from tca_cosim.cosim.linear_subsystem import Linear
from tca_cosim.cosim.node import MacroStep
from tca_cosim.studies.stability.model_problems import (
    Implicit,
    actuated,
    connected,
    couple,
    dahlquist,
    step_radius,
    two_masses,
)
from tca_cosim.studies.stability.verdict import spectral_growth

# -- split Dahlquist: x' = -x + u, u = -4 x
# -------------------------------------------------------------------------------


def test_explicit_held_coupling_is_the_recursion() -> None:
    """x_(n+1) = (5 exp(-H) - 4) x_n"""
    step = 0.3
    master, _ = couple(*dahlquist(), stop=10 * step, step=step, method=None, waveform="held")
    assert master.nodes[0].subsystem.values()[0] == pytest.approx((5.0 * math.exp(-step) - 4.0) ** 10, rel=1e-12)


def test_explicit_held_coupling_is_stable_up_to_ln_5_3() -> None:
    limit = math.log(5.0 / 3.0)
    assert step_radius(*dahlquist(), 0.99 * limit, method=None, waveform="held") < 1.0
    assert step_radius(*dahlquist(), 1.01 * limit, method=None, waveform="held") > 1.0


def test_plain_iteration_contracts_up_to_ln_4_3() -> None:
    limit = math.log(4.0 / 3.0)
    settings = {"method": "plain", "waveform": "held", "max_sweeps": 3000, "halvings": 0}
    couple(*dahlquist(), stop=0.99 * limit, step=0.99 * limit, **settings)
    with pytest.raises(CouplingError) as caught:
        couple(*dahlquist(), stop=1.01 * limit, step=1.01 * limit, **settings)
    assert caught.value.gain == pytest.approx(4.0 * (1.0 - math.exp(-1.01 * limit)), rel=1e-6)


def test_beyond_the_limit_a_failed_step_is_halved() -> None:
    _, log = couple(*dahlquist(), stop=1.2, step=0.4, method="plain", waveform="held", max_sweeps=1000)
    assert log[-1].time == 1.2
    assert max(entry.step for entry in log) < math.log(4.0 / 3.0)


# -- an actuator on an oscillator: x'' = -x - d x' + F, F = -4 x
# -------------------------------------------------------------


def test_explicit_coupling_of_an_undamped_rod_is_unstable_for_every_step() -> None:
    """Two equal moduli whose product is det = 1 + 4 (1 - cos H)."""
    for step in (0.05, 0.1):
        radius = step_radius(*actuated(), step, method=None, waveform="held", through="held")
        assert radius**2 == pytest.approx(1.0 + 4.0 * (1.0 - math.cos(step)), rel=1e-6)


@pytest.mark.parametrize(("waveform", "limit"), [("held", 0.0505), ("linear", 0.244)])
def test_explicit_coupling_of_a_damped_rod_has_a_limit(waveform: str, limit: float) -> None:
    """Damping ratio 0.05; for held forces near H = 2 d/k_T = 0.05."""
    assert step_radius(*actuated(0.1), 0.99 * limit, method=None, waveform=waveform) < 1.0
    assert step_radius(*actuated(0.1), 1.01 * limit, method=None, waveform=waveform) > 1.0


@pytest.mark.parametrize(
    ("waveform", "limit", "kind"),
    [("held", math.acos(0.75), Linear), ("linear", 1.2757, Linear), ("held", 0.5774, Implicit)],
    ids=["held", "linear", "backward Euler"],
)
def test_inertia_lets_plain_iteration_contract_for_short_steps(waveform: str, limit: float, kind: type[Linear]) -> None:
    settings = {"method": "plain", "waveform": waveform, "max_sweeps": 5000, "halvings": 0}
    couple(*actuated(kind=kind), stop=0.99 * limit, step=0.99 * limit, **settings)
    with pytest.raises(CouplingError) as caught:
        couple(*actuated(kind=kind), stop=1.01 * limit, step=1.01 * limit, **settings)
    assert 1.0 < caught.value.gain < 1.05


# -- two masses, spring and damper between them, all parameters 1
# ------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "jacobi", "degree", "limit"),
    [
        ("force", True, "linear", 0.444),  # the feedthrough output carries the extrapolated input, as FMI 2.0 has it
        ("force", True, "quadratic", 0.130),
        ("force", False, "linear", 1.014),
        ("force", False, "quadratic", 0.503),
        ("displacement", True, "linear", 0.940),
        ("displacement", True, "quadratic", 0.509),
    ],
)
def test_first_unstable_step_of_explicit_coupling(kind: str, jacobi: bool, degree: str, limit: float) -> None:
    how = {"method": None, "waveform": degree, "through": degree, "jacobi": jacobi}
    assert step_radius(*two_masses(kind), 0.99 * limit, **how) < 1.0
    assert step_radius(*two_masses(kind), 1.01 * limit, **how) > 1.0


@pytest.mark.parametrize(("degree", "limit"), [("held", 1.163), ("linear", 0.596), ("quadratic", 0.331)])
def test_first_unstable_step_with_outputs_of_the_same_instant(degree: str, limit: float) -> None:
    """What other standards allow: a force that answers the motion now, not that of the step before."""

    def radius(step: float) -> float:
        systems, connections = two_masses("force")
        for system in systems:
            system.start = system.start + 0.1 * np.arange(1.0, system.start.size + 1.0)
        master = connected(systems, connections, None, degree, degree, jacobi=True)
        record = []
        for number in range(80):
            master.advance(MacroStep(number * step, step, (number + 1) * step))
            past = {node: node.samples[:-1] for node in master.nodes}
            master.arrive((number + 1) * step)  # evaluates the outputs anew, but forgets what was before
            for node in master.nodes:
                node.samples = (*past[node], *node.samples)
            record.append(np.concatenate([system.state for system in systems]))
        return spectral_growth(record)

    assert radius(0.99 * limit) < 1.0
    assert radius(1.01 * limit) > 1.0


@pytest.mark.parametrize(
    ("kind", "jacobi", "degrees"),
    [
        ("force", True, ["held"]),
        ("force", False, ["held"]),
        ("displacement", True, ["held"]),
        ("displacement", False, ["held", "linear", "quadratic"]),
    ],
)
def test_explicit_coupling_without_a_limit(kind: str, jacobi: bool, degrees: list[str]) -> None:
    for degree in degrees:
        how = {"method": None, "waveform": degree, "through": degree, "jacobi": jacobi}
        for step in (0.2, 1.0, 4.0, 10.0):
            assert step_radius(*two_masses(kind), step, **how) < 1.0


@pytest.mark.parametrize("degree", ["held", "linear", "quadratic"])
def test_converged_coupling_has_no_limit(degree: str) -> None:
    for step in (0.5, 2.0, 8.0):
        assert step_radius(*two_masses("displacement"), step, waveform=degree, through=degree, tolerance=1e-12) < 1.0


def test_undamped_masses_stay_neutral_with_linear_waveforms() -> None:
    """m = 1, k = 4 pi^2, coupling 16 pi^2: neutral for lines, growing by 4e-3 a step of 0.01 for held inputs."""
    masses = two_masses("displacement", 4.0 * math.pi**2, 0.0, 16.0 * math.pi**2, 0.0)
    how = {"tolerance": 1e-13, "max_sweeps": 60}
    for step in (0.05, 0.17):
        assert step_radius(*masses, step, waveform="linear", through="linear", **how) == pytest.approx(1.0, abs=1e-7)
    held = step_radius(*masses, 0.01, waveform="held", through="held", **how)
    assert held - 1.0 == pytest.approx(4e-3, rel=0.1)


# -- orders
# ---------------------------------------------------------------------------------------------------------------


def slope(waveform: str, method: str | None, jacobi: bool, step: float = 0.02, gain: float = 4.0) -> float:
    """Order seen between a step and its half, split Dahlquist to t = 1."""
    errors = []
    for h in (step, 0.5 * step):
        systems, connections = dahlquist(gain)
        couple(systems, connections, 1.0, h, method, waveform, jacobi=jacobi, tolerance=1e-13)
        errors.append(abs(systems[0].values()[0] - math.exp(-1.0 - gain)))
    return math.log2(errors[0] / errors[1])


@pytest.mark.parametrize("jacobi", [False, True], ids=["gauss_seidel", "jacobi"])
@pytest.mark.parametrize(("waveform", "order"), [("held", 1), ("linear", 2), ("quadratic", 3), ("hermite", 4)])
def test_converged_coupling_has_the_order_of_the_waveform(waveform: str, order: int, jacobi: bool) -> None:
    assert slope(waveform, "iqn", jacobi) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize(
    ("jacobi", "step", "gain"), [(False, 0.005, 4.0), (True, 0.01, 0.25)], ids=["gauss_seidel", "jacobi"]
)
@pytest.mark.parametrize(("waveform", "order"), [("held", 1), ("linear", 2), ("quadratic", 3), ("hermite", 4)])
def test_explicit_coupling_has_the_order_of_the_extrapolation(
    waveform: str, order: int, jacobi: bool, step: float, gain: float
) -> None:
    """Jacobi sends everything one step late, which leaves cubics little room: a weaker loop shows the slope sooner."""
    assert slope(waveform, None, jacobi, step, gain) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize("method", ["plain", "aitken", "iqn", "broyden", "newton", "tangent", "relaxed"])
def test_every_method_finds_the_same_answer(method: str) -> None:
    systems, connections = dahlquist()
    couple(systems, connections, 1.0, 0.1, method, "linear", tolerance=1e-12, max_sweeps=200)
    reference, _ = dahlquist()
    couple(reference, connections, 1.0, 0.1, "iqn", "linear", tolerance=1e-13)
    assert systems[0].values()[0] == pytest.approx(reference[0].values()[0], abs=1e-11)
