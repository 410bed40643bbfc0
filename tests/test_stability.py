"""Stability maps: points either side of every limit that theory gives, of the FMUs and of analytic systems, judged by
runs; the map's file and figure."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from dask.distributed import LocalCluster
from tca_cosim import SceneError, read, results
from tca_cosim.files import save_figure
from tca_cosim.parallel import spread
from tca_cosim.scene.body import SegmentParameters
from tca_cosim.studies.stability import KINDS, StabilityStudy, Verdict, chart, oscillators, rod, run_study
from tca_cosim.studies.stability.theory import Beam, stability_limit

MOVING = ("rod.dynamic=true", "rod.body.retardation=0")


def beam(*overrides: str) -> Beam:
    return rod.beam_of(read("plain", [*rod.DEFAULTS, *overrides]))


def judged(overrides: tuple[str, ...], method: str, waveform: str, step: float, ratio: float) -> Verdict:
    return rod.judge_run("plain", overrides, beam().stiffness, method, waveform, step, ratio)


# -- theory


def test_the_gain_of_a_quasi_static_rod_is_the_closed_form() -> None:
    """3 k L/EA in stretch; without it the offset counts: 1.5 k L r^2/EI in bending."""
    body = beam()
    k, EA, EI = 79.5378, 2.96881, 1.85550e-5
    assert body.gain(0.1, k) == pytest.approx(3.0 * k * 0.04 / EA, rel=1e-5)
    assert k * 1.5 * body.offset**2 * body._rotation(0.0) == pytest.approx(1.5 * k * 0.04 * 0.0025**2 / EI, rel=1e-5)


def test_inertia_lowers_the_gain_as_its_first_mode_does_for_long_steps() -> None:
    """tanh(z)/z = 1 - z^2/3 + ...: 1/(1 + 1/(omega H)^2) with the frequency of equal compliance, omega^2 = 3 E/(rho
    L^2)."""
    body = beam(*MOVING)
    segment = body.body
    omega = math.sqrt(3.0 * segment.E / (segment.rho * segment.length**2))
    step = 10.0 / omega
    assert body.gain(step, body.stiffness) / 3.0 == pytest.approx(1.0 / (1.0 + 1.0 / (omega * step) ** 2), rel=1e-4)


def test_a_beam_without_shear_bends_as_euler_and_bernoulli_say() -> None:
    """Rotation per moment at the end: (L/EI) (cosh b sin b + sinh b cos b)/(b (1 + cosh b cos b)), b^4 = -s^2 rho A
    L^4/EI."""
    segment = SegmentParameters(
        length=1.0,
        radius=1e-3,
        radius_end=1e-3,
        E=1e5,
        nu=0.5,
        rho=1000.0,
        shear_factor=1e6,
        retardation=0.0,
        stiffness=(),
        curvature=(0.0,) * 3,
    )
    body = Beam(segment, offset=0.0, azimuths=(0.0,), dynamic=True)
    EI = segment.E * math.pi * segment.radius**4 / 4.0
    s = 0.05
    b = complex(-(s**2) * segment.rho * body.area * segment.length**4 / EI) ** 0.25
    exact = (np.cosh(b) * np.sin(b) + np.sinh(b) * np.cos(b)) / (b * (1.0 + np.cosh(b) * np.cos(b))) / EI
    assert abs(b) > 1.0
    assert body._rotation(s) == pytest.approx(exact.real, rel=1e-4)


# -- the FMUs either side of the limits


@pytest.mark.parametrize("overrides", [(), MOVING], ids=["quasi-static", "inertia"])
@pytest.mark.parametrize(
    ("method", "waveform", "beyond"),
    [
        ("none", "held", "unstable"),
        ("none", "linear", "unstable"),
        ("plain", "linear", "diverged"),
        ("relaxed", "linear", "diverged"),
    ],
)
def test_the_fmus_fail_where_theory_says(method: str, waveform: str, beyond: str, overrides: tuple[str, ...]) -> None:
    step = 2e-3
    edge = stability_limit(beam(*overrides), np.array([step]), method, waveform, rod.OMEGA)[0]
    below, above = (judged(overrides, method, waveform, step, factor * edge) for factor in (0.93, 1.07))
    assert below.kind == "converged"
    assert above.kind == beyond


@pytest.mark.parametrize("step", [1e-3, 1e-2])
def test_the_gain_of_a_moving_rod_is_that_of_theory(step: float) -> None:
    edge = stability_limit(beam(*MOVING), np.array([step]), "plain", "linear", rod.OMEGA)[0]
    assert judged(MOVING, "plain", "linear", step, 0.9 * edge).gain == pytest.approx(0.9, rel=2e-3)


@pytest.mark.parametrize("method", ["aitken", "iqn", "broyden", "newton", "tangent"])
def test_accelerated_methods_pass_the_limit_of_plain_iteration(method: str) -> None:
    edge = stability_limit(beam(), np.array([0.1]), "plain", "linear", rod.OMEGA)[0]
    verdict = judged((), method, "linear", 0.1, 3.0 * edge)
    assert verdict.kind == "converged"
    assert verdict.gain == pytest.approx(3.0, rel=0.05)
    farthest = 100.0 if method == "broyden" else 150.0  # beyond, Broyden's second guess admits no shape of the rod
    assert judged((), method, "linear", 0.5, farthest * edge).kind == "converged"


def test_what_theory_does_not_cover_is_refused() -> None:
    with pytest.raises(SceneError, match=r"rod\.closure = 1"):
        rod.rod_study("plain", ["rod.closure=inside"])
    with pytest.raises(SceneError, match=r"rod\.tca\.helix"):
        rod.rod_study("plain", ["rod.tca.helix=3"])
    with pytest.raises(SceneError, match=r"rod\.method = 2"):
        rod.rod_study("plain", ["rod.dynamic=true", "rod.method=rosenbrock"])


@pytest.mark.parametrize("step", [5e-4, 2.8e-3])
@pytest.mark.parametrize("waveform", ["held", "linear"])
def test_a_swinging_rod_is_not_taken_for_an_unstable_one(waveform: str, step: float) -> None:
    assert judged(MOVING, "none", waveform, step, 0.05).kind == "converged"


# -- analytic systems


MARKED = [panel for panel in oscillators.panels() if panel.marks]


@pytest.mark.parametrize("panel", MARKED, ids=[panel.title for panel in MARKED])
def test_analytic_systems_fail_at_their_known_limits(panel: object) -> None:
    """Within 1 % in the macro step: the limits are known to three digits."""
    ((step, strength),) = panel.marks
    assert panel.judge(0.99 * step, strength).kind == "converged"
    assert panel.judge(1.01 * step, strength).kind in ("diverged", "unstable")


@pytest.mark.parametrize("panel", [p for p in MARKED if p.limit], ids=lambda panel: panel.title)
def test_closed_forms_go_through_the_known_limits(panel: object) -> None:
    ((step, strength),) = panel.marks
    assert panel.limit(np.array([step]))[0] == pytest.approx(strength, rel=0.01)


def test_the_limit_of_a_damped_actuator_is_twice_damper_over_stiffness_for_short_steps() -> None:
    panel = next(p for p in MARKED if p.title.startswith("actuator: explicit, held"))
    step = 1e-3
    assert panel.limit(np.array([step]))[0] == pytest.approx(2.0 * oscillators.DAMPING / step, rel=0.01)


def test_converged_coupling_of_two_masses_has_no_limit() -> None:
    panel = oscillators.panels()[-1]
    assert not panel.marks
    assert {panel.judge(h, r).kind for h in (0.1, 1.6) for r in (0.1, 10.0)} == {"converged"}


# -- maps


@pytest.fixture(scope="module")
def small() -> StabilityStudy:
    whole = oscillators.oscillator_study(points=4)
    return StabilityStudy(**{**vars(whole), "panels": whole.panels[:2]})


@pytest.fixture(scope="module")
def swept(small: StabilityStudy) -> xr.Dataset:
    return run_study(small)


def test_a_map_is_a_file_with_units_settings_and_versions(swept: xr.Dataset, tmp_path: Path) -> None:
    results.write(swept, tmp_path / "map.nc")
    actual = results.read(tmp_path / "map.nc")
    assert actual["verdict"].dims == ("panel", "step", "strength")
    assert actual["step"].attrs["units"] == "s"
    assert all(
        actual[name].attrs["units"] == "1" for name in ("strength", "verdict", "sweeps", "gain", "growth", "limit")
    )
    assert actual["verdict"].attrs["flag_meanings"].split() == list(KINDS)
    assert json.loads(actual.attrs["panels"])[1]["method"] == "plain"
    assert json.loads(actual.attrs["settings"])["damping of the actuated oscillator"] == oscillators.DAMPING
    assert "numpy" in json.loads(actual.attrs["versions"])
    fails = actual["verdict"] != KINDS.index("converged")
    slow = actual["verdict"] == KINDS.index("slow")
    assert ((fails == (actual["strength"] > actual["limit"])) | slow).all()


def test_the_map_of_a_scene_says_what_was_run(tmp_path: Path) -> None:
    whole = rod.rod_study("plain", MOVING, points=2)
    actual = run_study(StabilityStudy(**{**vars(whole), "panels": whole.panels[2:3]}))
    settings = json.loads(actual.attrs["settings"])
    assert settings["EA/L [N/m]"] == pytest.approx(74.22, rel=1e-4)
    assert "dynamic" in settings["members"]
    assert actual["panel"].item() == "plain"
    assert set(np.unique(actual["verdict"])) == {KINDS.index("converged"), KINDS.index("diverged")}


def test_the_figure(small: StabilityStudy, swept: xr.Dataset, tmp_path: Path) -> None:
    figure = chart.draw(swept)
    paths = save_figure(figure, tmp_path, "map")
    assert [path.suffix for path in paths] == [".png", ".svg"]
    drawn = [axes for axes in figure.axes if axes.get_title()]
    assert [axes.get_title() for axes in drawn] == [panel.title for panel in small.panels]
    np.testing.assert_allclose(drawn[0].lines[0].get_ydata(), small.panels[0].limit(small.steps))


def test_rows_spread_by_dask_are_those_of_one_process(small: StabilityStudy, swept: xr.Dataset) -> None:
    """A worker in this process: what dask does is the same."""
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as cluster:
        actual = run_study(small, lambda rows: spread(rows, scheduler=cluster.scheduler_address))
    assert actual.identical(swept)
