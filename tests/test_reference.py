"""The independent solution against tables of third codes and closed forms, its own conservation laws, and the
co-simulation against it."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
from scipy.spatial.transform import Rotation
from tca_cosim import results
from tca_cosim.scene.manipulator import Geometry, ThermalParameters
from tca_cosim.verification import reference
from tca_cosim.verification.reference.dynamics import DynamicRod
from tca_cosim.verification.reference.heat import heat
from tca_cosim.verification.reference.radau import NODES, LinearRadau
from tca_cosim.verification.reference.rod import Loads, RodData, WireLaw
from tca_cosim.verification.reference.section import Section, triangulate
from tca_cosim.verification.reference.statics import equilibrium

DATA = Path(__file__).parent / "data"
COLD = 298.15  # K
SECTION = Section(5e-3, (0.85e-3,) * 3, (0.2e-3,) * 3, (2.5e-3,) * 3, (0.0, 2 * np.pi / 3, 4 * np.pi / 3))


def table(name: str) -> np.ndarray:
    lines = [line for line in (DATA / name).read_text().splitlines() if not line.startswith("#")]
    return np.genfromtxt(lines, delimiter=",", names=True, dtype=None, encoding=None)


def heat_data(alpha: float = 0.0) -> ThermalParameters:
    return ThermalParameters(
        geometry=Geometry(SECTION.radius, 0.04, SECTION.offset, SECTION.azimuth),
        outer_radius=SECTION.outer_radius,
        inner_radius=SECTION.inner_radius,
        body_k=0.19,
        body_rho_c=0.669e6,
        tca_k=(0.19,) * 3,
        tca_rho_c=(0.969e6,) * 3,
        transfer=20.0,
        resistance=(6.9,) * 3,
        alpha=(alpha,) * 3,
        beta=(0.0,) * 3,
        T_ref=COLD,
        T_0=COLD,
    )


def rod_data(rho: float = 1040.0, shear: float = 1.0, retardation: float = 0.0, bare: bool = False) -> RodData:
    E, radius, length = 37.8e3, 5e-3, 0.04
    area, second = np.pi * radius**2, np.pi * radius**4 / 4
    K = E * np.array([second, second, 2 * second / 3, shear * area / 3, shear * area / 3, area])
    gamma = rho * np.array([second, second, 2 * second, area, area, area])
    law = WireLaw(0.13, length, 0.65e-3, 37.5, 100.0, 560e6, 6.5e-4)
    k = 0.0 if bare else 1.0 / law.f1
    rest = np.array([0, 0, 0, 0, 0, 1.0])
    return RodData(
        length,
        K,
        rest,
        gamma,
        retardation,
        np.full(3, 2.5e-3),
        np.array(SECTION.azimuth),
        np.zeros(3),
        np.full(3, k),
        (law,) * 3,
        np.ones(3),
        COLD,
    )


def loads(T: object = COLD, gravity: object = 0.0, force: object = 0.0, moment: object = 0.0) -> Loads:
    return Loads(*(np.broadcast_to(np.asarray(x, dtype=float), (3,)).copy() for x in (T, gravity, force, moment)))


def constant_voltage(volts: list[float], marks: np.ndarray, alpha: float = 0.0, **settings: float):
    steady = np.array(volts)
    return heat(heat_data(alpha), lambda t, a, b: steady, lambda t, a, b: COLD, [marks], **settings)


def test_mesh_has_the_areas_and_the_surface_of_the_section() -> None:
    from skfem import Basis, ElementTriP2, FacetBasis, Functional

    @Functional
    def one(w):
        return 1.0 + 0.0 * w.x[0]

    for edge, tolerance in ((0.3e-3, 1e-4), (0.15e-3, 1e-5)):
        mesh = triangulate(SECTION, edge)
        for i in range(3):
            tca_area = one.assemble(Basis(mesh, ElementTriP2(), elements=f"tca{i}"))
            assert tca_area == pytest.approx(SECTION.tca_areas[i], rel=tolerance)
        whole = one.assemble(Basis(mesh, ElementTriP2()))
        assert whole == pytest.approx(np.pi * (25e-6 - 3 * 0.04e-6), rel=tolerance)
        surface = one.assemble(FacetBasis(mesh, ElementTriP2(), facets="outer"))
        assert surface == pytest.approx(np.pi * 1e-2, rel=tolerance)
    with pytest.raises(ValueError, match="overlap"):
        triangulate(Section(5e-3, (2.3e-3,) * 3, (0.2e-3,) * 3, (2.5e-3,) * 3, SECTION.azimuth), 0.3e-3)


def test_time_integrator_is_of_fifth_order() -> None:
    from scipy.sparse import csc_matrix

    mass, stiffness = csc_matrix([[2.0, 0.5], [0.5, 1.0]]), csc_matrix([[3.0, -1.0], [-1.0, 2.0]])
    # The load makes u = (cos t, sin 2t) the solution.
    load = lambda t: mass @ np.array([-np.sin(t), 2 * np.cos(2 * t)]) + stiffness @ np.array([np.cos(t), np.sin(2 * t)])  # noqa: E731
    errors = []
    for count in (8, 16):
        h, u, integrate = 2.0 / count, np.array([1.0, 0.0]), LinearRadau(mass, stiffness)
        for k in range(count):
            u = integrate.step(u, h, np.array([load((k + c) * h) for c in NODES]))[0][-1]
        errors.append(np.abs(u - [np.cos(2.0), np.sin(4.0)]).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5.0, abs=0.3)


def test_heat_meets_an_independent_code() -> None:
    expected = table("thermal_step.csv")
    marks = np.array([0.0, *expected["t_s"]])
    wanted = np.column_stack([expected[f"T{i}"] for i in (1, 2, 3)]) + 273.15
    for edge, tolerance in ((0.2e-3, 2e-3), (0.14e-3, 5e-4)):
        actual = constant_voltage([0.0, 1.5, 3.0], marks, edge=edge, step=0.5)
        assert np.abs(actual.T[1:] - wanted).max() < tolerance


def test_heat_is_conserved_and_settles_where_power_equals_loss() -> None:
    times = np.linspace(0.0, 20.0, 201)
    actual = constant_voltage([3.0, 1.0, 0.0], times, edge=0.3e-3)
    given, gone = np.trapezoid(actual.P.sum(axis=1), times), np.trapezoid(actual.loss, times)
    assert given - gone == pytest.approx(actual.stored[-1], rel=1e-6)
    late = constant_voltage([1.0] * 3, np.array([0.0, 2e4]), edge=0.3e-3, step=1e3)
    assert late.loss[-1] == pytest.approx(late.P[-1].sum(), rel=1e-9)


def test_resistance_follows_temperature() -> None:
    actual = constant_voltage([0.0, 0.0, 3.0], np.array([0.0, 10.0]), alpha=4e-3, edge=0.3e-3, step=0.5)
    assert actual.P[-1, 2] == pytest.approx(9.0 / (6.9 * (1 + 4e-3 * (actual.T[-1, 2] - COLD))), rel=1e-9)
    assert actual.P[-1, 2] < 0.95 * actual.P[0, 2]


def test_equilibria_meet_an_independent_code() -> None:
    rows = table("rod_static.csv")
    pick = lambda *names: np.array([rows[n] for n in names], dtype=float)  # noqa: E731
    zero = np.zeros((3, len(rows)))
    asked = Loads(pick("T1", "T2", "T3") + 273.15, pick("g1", "g2", "g3"), zero, zero)
    actual = equilibrium(rod_data(), asked)
    assert np.abs(actual.p[:, -1] - pick("x", "y", "z")).max() < 2e-7
    angles = Rotation.from_matrix(actual.R[:, :, -1].transpose(2, 0, 1)).as_euler("XYZ").T
    assert np.abs(angles - pick("alpha", "beta", "gamma")).max() < 1e-6
    assert np.abs(actual.delta - pick("delta1", "delta2", "delta3")).max() < 1e-8


def test_small_strains_are_those_of_the_closed_form() -> None:
    """Stretch e = k sum c/(EA + 3 k L), curvature k r |sum c_i e_i|/(EI + 1.5 k L r^2), c the free strokes."""
    data, rise = rod_data(), np.array([1e-3, 0.0, 0.0])
    actual = equilibrium(data, loads(T=COLD + rise), np.array([0.01, 0.04]))
    stroke, k = data.stroke(COLD + rise)[0], data.tca_stiffness[0]
    stretch = k * stroke / (2.96881 + 3 * k * 0.04)
    curvature = k * 2.5e-3 * stroke / (1.85550e-5 + 1.5 * k * 0.04 * 2.5e-3**2)
    assert actual.xi[5, :, 0] - 1.0 == pytest.approx([stretch] * 2, rel=1e-4)
    assert np.linalg.norm(actual.xi[:3, :, 0], axis=0) == pytest.approx([curvature] * 2, rel=1e-4)
    assert actual.p[0, -1, 0] < 0.0  # a hot TCA at +x pushes the tip to -x


def test_tip_couple_rolls_the_rod_up() -> None:
    """M = 2 pi EI/L about y closes the bare rod to a circle: the tip returns to the clamp."""
    data = rod_data(bare=True)
    actual = equilibrium(data, loads(moment=[0.0, 2 * np.pi * data.stiffness[1] / data.length, 0.0]))
    assert np.abs(actual.p[:, -1, 0]).max() < 1e-9


def test_no_equilibrium_is_an_error_that_says_so() -> None:
    with pytest.raises(tca.SubsystemError, match="no equilibrium found"):
        equilibrium(rod_data(), loads(T=np.nan))


def test_an_observer_ends_the_search_for_an_equilibrium() -> None:
    with pytest.raises(StopIteration):
        equilibrium(rod_data(), loads(T=COLD + 20.0), observe=partial(next, iter([0, 1])))


@pytest.mark.parametrize("damped", [True, False])
def test_release_meets_an_independent_code(damped: bool) -> None:
    """And without damping keeps its energy."""
    mover = DynamicRod(rod_data(1070.0, 27 / 28, 5e-3 if damped else 0.0, bare=True))
    falling, expected = loads(gravity=[9.81, 0.0, 0.0]), table("rod_release.csv")
    start = mover.state_at_rest(equilibrium(mover.data, loads(), mover.stations()))
    states = mover.run(start, np.array([0.0, 0.05, 0.1]), lambda t: falling, 1e-6)
    seen = [mover.snapshot(y, falling) for y in states.T]
    ending = "damped" if damped else "undamped"
    for shot, axis, across in zip(seen[1:], expected[f"axis_{ending}"], expected[f"defl_{ending}"], strict=False):
        assert 1e3 * shot.p == pytest.approx([across, 0.0, axis], abs=1e-4)  # the table's digits, in mm
    total = np.array([sum(shot.energy.values()) for shot in seen])
    if damped:
        assert (np.diff(total) < 0.0).all()
    else:
        assert np.ptp(total) < 1e-6 * seen[1].energy["kinetic"]


def test_discrete_rod_converges_at_second_order_to_the_same_release() -> None:
    """Degree 1 is a staggered grid; its extrapolation meets the table too."""
    falling, tips = loads(gravity=[9.81, 0.0, 0.0]), []
    for count in (6, 12, 24):
        mover = DynamicRod(rod_data(1070.0, 27 / 28, 5e-3, bare=True), count, 1)
        start = mover.state_at_rest(equilibrium(mover.data, loads(), mover.stations()))
        tips.append(mover.snapshot(mover.run(start, np.array([0.0, 0.05]), lambda t: falling, 1e-6)[:, -1], falling).p)
    coarse, middle, fine = tips
    assert np.linalg.norm(coarse - middle) / np.linalg.norm(middle - fine) == pytest.approx(4.0, abs=0.4)
    row = table("rod_release.csv")[0]
    wanted = 1e-3 * np.array([row["defl_damped"], 0.0, row["axis_damped"]])
    assert np.abs((4 * fine - middle) / 3 - wanted).max() < 1e-6


def test_the_moving_rod_stays_in_the_equilibrium_of_the_shooting_method() -> None:
    """TCAs hot, gravity and a wrench on the tip: all loads of the two methods at once."""
    pulled = loads([COLD + 20, COLD, COLD + 5], [3.0, 2.0, -4.0], [2e-3, 1e-3, -1e-3], [5e-6, 0.0, 2e-5])
    mover = DynamicRod(rod_data(retardation=5e-3))
    rest = equilibrium(mover.data, pulled, mover.stations())
    start = mover.state_at_rest(rest)
    last = mover.snapshot(mover.run(start, np.array([0.0, 0.1]), lambda t: pulled, 1e-6)[:, -1], pulled)
    assert last.p == pytest.approx(rest.p[:, -1, 0], abs=1e-7)
    assert last.delta == pytest.approx(rest.delta[:, 0], abs=1e-8)
    assert Rotation.from_quat(last.quaternion).as_matrix() == pytest.approx(rest.R[:, :, -1, 0], abs=1e-5)


BOUNDS = {"thermal.T": 5e-3, "rod.tip.p": 1e-4 * 0.04, "rod.delta": 1e-6, "rod.tip.euler": 1e-3}


@pytest.mark.parametrize(
    "overrides",
    [
        ["stop_time=2 s"],
        ["stop_time=1 s", "thermal.V[2]={steps=[[0, 3.0], [0.55, 0.0]]}", "rod.gravity=[6.0, 0.0, -9.81]"],
        [
            "stop_time=0.3 s",
            "coupling.macro_step=0.01",
            "rod.dynamic=true",
            "rod.closure=inside",
            "rod.body.retardation=5e-3",
            "rod.gravity=[9.81, 0.0, 0.0]",
        ],
    ],
    ids=["step", "switched under gravity", "falling"],
)
def test_cosimulation_meets_the_reference(overrides: list[str]) -> None:
    scene = tca.read("step", overrides)
    actual = {gap.name: gap for gap in reference.compare(tca.run(scene), reference.run(scene))}
    assert set(BOUNDS) | {"rod.N", "thermal.P", "thermal.E_stored", "thermal.Q_loss"} <= set(actual)
    for name, bound in BOUNDS.items():
        assert actual[name].most < min(bound, 0.02 * actual[name].span), actual[name]


def test_feedback_of_the_shape_on_the_heat_meets_the_reference() -> None:
    """Resistances that double: the co-simulation iterates its loop step by step, the reference whole courses."""
    short = ["stop_time=2 s", "coupling.macro_step=0.05"]
    scene = tca.read("feedback", short)
    solved = reference.run(scene, reference.Resolution(edge=0.06, heat_step=0.2, shooting=1e-7))
    one_way = tca.run(tca.read("feedback", [*short, "thermal.tca.beta=0"]))
    actual = {gap.name: gap for gap in reference.compare(tca.run(scene), solved)}
    assert actual["rod.tip.p"].most < BOUNDS["rod.tip.p"]
    assert actual["rod.delta"].most < BOUNDS["rod.delta"]
    assert actual["thermal.T"].most < 5e-3
    assert abs(one_way["thermal.T"][-1, 2] - solved["thermal.T"][-1, 2]) > 0.5


def test_output_times_can_be_chosen_and_the_result_is_written(tmp_path: Path) -> None:
    scene = tca.read("step", ["stop_time=0.5 s", "thermal.V[2]={steps=[[0, 3.0], [0.25, 0.0]]}"])
    solved = reference.run(scene, times=np.array([0.0, 0.11, 0.4]))
    everywhere = reference.run(scene)
    assert solved["time"].values == pytest.approx([0.0, 0.11, 0.4])
    gap = next(g for g in reference.compare(everywhere, solved) if g.name == "thermal.T")
    assert gap.most < 1e-5  # steps in time differ
    results.write(solved, tmp_path / "there.nc")
    assert results.read(tmp_path / "there.nc").attrs["scene"] == "step"
    with pytest.raises(tca.SceneError, match="increase"):
        reference.run(scene, times=np.array([0.0, 0.9]))
    with pytest.raises(ValueError, match="nothing to compare"):
        reference.compare(everywhere.drop_vars(list(everywhere.data_vars)), solved)


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("rod.tca.pitch=current", "tca.pitch"),
        ("rod.tca.pitch[2]=current", "tca.pitch"),
        ("rod.segment.radius[1,2]=3 mm", "a radius that changes"),
        ("rod.tca.offset_end[1]=1 mm", "a distance of a TCA"),
        ("rod.tca.contact=bonded", "tca.contact = 'bonded'"),
        ("rod.tca.ends=tethered", "tca.ends = 'tethered'"),
        ("rod.tip_body.mass=2 g", "a body at the tip"),
    ],
)
def test_what_is_not_covered_is_refused(override: str, named: str) -> None:
    fitting = ["tca.offset=2 mm", "thermal.body.radius=4 mm"] if "radius" in override else []
    scene = tca.read("step", [*fitting, override])
    with pytest.raises(tca.SceneError, match=re.escape(named)):
        reference.run(scene)


def test_each_tca_has_its_own_law() -> None:
    """The shooting method and the FMU see the same TCAs, also where these differ from each other."""
    differing = {
        "rod.tca.chirality[1]": -1,
        "rod.tca.law[2]": "measured",
        "rod.tca.stroke[2]": 3e-4,
        "rod.tca.stiffness[2]": 30.0,
        "rod.tca.coils[3]": 30.0,
        "tca.offset": [2.5e-3, 2e-3, 2.5e-3],
    }
    scene = tca.read("step", {"stop_time": 1.0, "coupling.macro_step": 0.5, **differing})
    actual = {gap.name: gap for gap in reference.compare(tca.run(scene), reference.run(scene))}
    assert actual["rod.tip.p"].most < BOUNDS["rod.tip.p"]
    assert actual["rod.N"].span > 1e-4
