"""Dimensionless numbers, the levels that they propose, and planes of symmetry, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid
from tca_cosim import read
from tca_cosim import scene as scenes
from tca_cosim.cosim.signals import Constant, Impulse, Ramps, Sine, Steps
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.studies.model_selection.dimensionless_numbers import (
    dimensionless_numbers,
    is_unheated,
    residual_envelope,
    residual_vibration,
    rise_time,
)
from tca_cosim.studies.model_selection.hierarchy import model_hierarchies
from tca_cosim.studies.model_selection.proposal import propose_choice
from tca_cosim.studies.model_selection.symmetry import symmetry_plane

# -- dimensionless numbers ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("periods", [0.3, 1.0, 1.7, 4.25])
def test_residual_is_what_an_oscillator_keeps_after_a_ramp(periods: float) -> None:
    w = 2.0 * math.pi
    during = solve_ivp(
        lambda t, y: [y[1], w**2 * (t / periods - y[0])], (0.0, periods), [0.0, 0.0], rtol=1e-11, atol=1e-13
    )
    x, v = during.y[:, -1]
    assert residual_vibration(w, periods) == pytest.approx(math.hypot(x - 1.0, v / w), abs=1e-8)
    assert residual_vibration(w, periods) <= residual_envelope(w, periods)


def test_numbers_of_a_round_rod() -> None:
    """I/A = R^2/4, E/G = 2 (1 + nu) = 3; R/L = 1/8; weight and first frequency as in textbooks."""
    actual = dimensionless_numbers(read("drop"))
    assert actual.extension == pytest.approx(1.0 / 256.0)
    assert actual.shear == pytest.approx(12.0 * 3.0 / 256.0)
    assert actual.biot == pytest.approx(20.0 * 5e-3 / 0.19)
    assert actual.gravity == pytest.approx(4.0 * 1040.0 * 9.81 * 0.04**3 / (37.8e3 * 5e-3**2))
    assert actual.frequency == pytest.approx(5.2713, rel=1e-4)
    assert actual.ramp == 0.0
    assert actual.residual == 1.0
    assert not actual.arc
    assert dimensionless_numbers(read("load")).tip == pytest.approx(0.05 * 0.04**2 / (37.8e3 * math.pi * 5e-3**4 / 4.0))
    assert dimensionless_numbers(read("hang")).ramp == 30.0  # at equilibrium from the start: gravity is no jump
    assert dimensionless_numbers(read("tap")).ramp == 0.02
    still = read("step", ["thermal.V=0"])
    assert (dimensionless_numbers(still).ramp, dimensionless_numbers(still).residual) == (math.inf, 0.0)


@pytest.mark.parametrize("retardation", [0.0, 1e-3])
def test_vibration_is_the_rms_of_what_rings_down(retardation: float) -> None:
    """An oscillator of the first mode that a ramp leaves with the envelope of the residual."""
    scene = read("explicit", [f"rod.body.retardation={retardation}"])
    numbers = dimensionless_numbers(scene)
    w, ratio = 2.0 * math.pi * numbers.frequency, numbers.damping
    assert ratio == pytest.approx(0.5 * w * retardation)
    times = np.linspace(0.0, scene.stop_time, 20001)
    course = numbers.residual * np.exp(-ratio * w * times)
    assert numbers.vibration == pytest.approx(math.sqrt(trapezoid(0.5 * course**2, times) / scene.stop_time), rel=1e-6)


def test_what_rings_is_proposed_with_inertia_and_the_shapes_of_a_vibration() -> None:
    scene = read("explicit")
    hierarchies, numbers = model_hierarchies(scene), dimensionless_numbers(scene)
    ringing = propose_choice(hierarchies, numbers, 1e-4)
    assert (ringing["inertia"], ringing["strains"], ringing["order"]) == (1, 3, 2)
    quiet = propose_choice(hierarchies, numbers, 1e-2)
    assert (quiet["inertia"], quiet["order"]) == (0, 0)


def test_arcs_are_what_parallel_tcas_alone_make() -> None:
    assert all(dimensionless_numbers(read(name)).arc for name in ("step", "switch", "sine", "feedback"))
    assert not dimensionless_numbers(read("step", ["rod.tca.helix=10"])).arc
    assert not dimensionless_numbers(read("step", ["rod.tip_moment[2]=1e-5"])).arc


@pytest.mark.parametrize(
    ("signal", "expected"),
    [
        (Constant(3.0), math.inf),
        (Steps((0.0, 1.0), (0.0, 1.0)), 0.0),
        (Steps((0.0, 1.0), (2.0, 2.0)), math.inf),
        (Ramps((0.0, 1.0, 5.0, 7.0), (0.0, 0.0, 1.0, 0.5)), 2.0),
        (Sine(0.0, 1.0, 4.0), 2.0),
        (Impulse(1.0, 0.3), 0.3),
    ],
)
def test_how_long_a_load_takes_to_grow(signal: object, expected: float) -> None:
    assert rise_time(signal) == expected


@pytest.mark.parametrize(
    ("scene", "overrides", "expected"),
    [
        ("drop", [], True),
        ("tap", [], True),
        ("step", [], False),
        ("push", [], False),
        ("step", ["thermal.V=0"], True),
        ("step", ["thermal.V={steps=[[0,0],[1,0],[2,1]]}"], False),
        ("drop", ["thermal.T_ambient=299"], False),
        ("drop", ["thermal.T_ambient=299", "thermal.T_0=299"], True),
        ("drop", ["thermal.T_ambient={ramps=[[0,298.15],[1,300]]}"], False),
        ("drop", ['connections=["thermal.T_surface -> thermal.T_ambient", "thermal.T -> rod.T"]'], False),
    ],
)
def test_what_stays_cold(scene: str, overrides: list[str], expected: bool) -> None:
    assert is_unheated(scenes.read(scene, overrides, cached_archive)) is expected


def test_dimensionless_numbers_propose_levels() -> None:
    hierarchies = model_hierarchies(read("step"))
    calm, falling = (propose_choice(hierarchies, dimensionless_numbers(read(name)), 1e-3) for name in ("step", "drop"))
    assert (calm["inertia"], calm["order"], calm["strains"]) == (0, 0, 1)
    assert (falling["inertia"], falling["strains"]) == (1, 3)
    assert falling["order"] > 0
    thin = dimensionless_numbers(read("step", ["thermal.h=1e-3", "thermal.body.k=1", "thermal.tca.k=1"]))
    assert thin.biot < 0.1
    assert propose_choice(hierarchies, thin, 1e-3)["heat"] == 0


@pytest.mark.parametrize(
    ("scene", "overrides", "degrees"),
    [
        ("drop", [], 0.0),
        ("push", [], 0.0),
        ("pulse", [], 60.0),  # through the third TCA, at 240 degrees
        ("step", [], None),  # three voltages
        ("step", ["thermal.V=[3, 3, 1]"], 60.0),
        ("step", ["thermal.V=[3, 3, 1]", "thermal.tca.R=[6, 7, 7]"], None),
        ("drop", ["rod.gravity=[0, 9.81, 0]"], None),  # three TCAs have no mirror there
        ("drop", ["rod.gravity=[4.905, 8.495709211125343, 0]"], 60.0),
        ("drop", ["rod.gravity=[5, 8, 0]"], None),
        ("drop", ["rod.tca.helix=10"], None),
        ("drop", ["rod.tip_moment[2]=1e-4"], 0.0),
        ("drop", ["rod.tip_moment[3]=1e-4"], None),
        ("tap", ["rod.tip_force[2]={impulse={peak=0.01,width=0.01}}"], None),
    ],
)
def test_planes_that_everything_mirrors_in(scene: str, overrides: list[str], degrees: float | None) -> None:
    actual = symmetry_plane(scenes.read(scene, overrides, cached_archive))
    assert actual is None if degrees is None else math.degrees(actual) == pytest.approx(degrees)
