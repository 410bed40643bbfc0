"""No more model than a scene needs: screens against closed forms, the climb on errors that are known, and choices whose
true error is looked up with the finest models."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from test_cli import tca
from typer.testing import CliRunner

from orchestration import CosimError, SceneError, fidelity, read, results, run, titles
from orchestration import scene as scenes
from orchestration.archive import kept
from orchestration.cli import app
from orchestration.fidelity.climb import SHARE, above, climb, descend
from orchestration.fidelity.ladder import Axis, applied, ladder, settings
from orchestration.fidelity.measure import error, quantities
from orchestration.fidelity.proposal import propose
from orchestration.fidelity.screens import duration, envelope, numbers, residual
from orchestration.fidelity.study import candidates
from orchestration.fidelity.symmetry import plane
from orchestration.signals import Constant, Impulse, Ramps, Sine, Steps

# -- screens
# -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("periods", [0.3, 1.0, 1.7, 4.25])
def test_residual_is_what_an_oscillator_keeps_after_a_ramp(periods: float) -> None:
    w = 2.0 * math.pi
    during = solve_ivp(
        lambda t, y: [y[1], w**2 * (t / periods - y[0])], (0.0, periods), [0.0, 0.0], rtol=1e-11, atol=1e-13
    )
    x, v = during.y[:, -1]
    assert residual(w, periods) == pytest.approx(math.hypot(x - 1.0, v / w), abs=1e-8)
    assert residual(w, periods) <= envelope(w, periods)


def test_numbers_of_a_round_rod() -> None:
    """I/A = R^2/4, E/G = 2 (1 + nu) = 3; R/L = 1/8; weight and first frequency as in textbooks."""
    found = numbers(read("drop"))
    assert found.extension == pytest.approx(1.0 / 256.0)
    assert found.shear == pytest.approx(12.0 * 3.0 / 256.0)
    assert found.biot == pytest.approx(20.0 * 5e-3 / 0.19)
    assert found.gravity == pytest.approx(4.0 * 1040.0 * 9.81 * 0.04**3 / (37.8e3 * 5e-3**2))
    assert found.frequency == pytest.approx(5.2713, rel=1e-4)
    assert found.ramp == 0.0
    assert found.residual == 1.0
    assert not found.arc
    assert numbers(read("load")).tip == pytest.approx(0.05 * 0.04**2 / (37.8e3 * math.pi * 5e-3**4 / 4.0))
    assert numbers(read("hang")).ramp == 30.0  # at equilibrium from the start: gravity is no jump
    assert numbers(read("tap")).ramp == 0.02
    still = read("step", ["thermal.V=0"])
    assert (numbers(still).ramp, numbers(still).residual) == (math.inf, 0.0)


def test_arcs_are_what_parallel_tcas_alone_make() -> None:
    assert all(numbers(read(name)).arc for name in ("step", "switch", "sine", "feedback"))
    assert not numbers(read("step", ["rod.tca.helix=10"])).arc
    assert not numbers(read("step", ["rod.tip_moment[2]=1e-5"])).arc


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
    assert duration(signal) == expected


def test_screens_propose() -> None:
    axes = ladder(read("step"))
    calm, falling = (propose(axes, numbers(read(name)), 1e-3) for name in ("step", "drop"))
    assert (calm["inertia"], calm["order"], calm["strains"]) == (0, 0, 1)
    assert (falling["inertia"], falling["strains"]) == (1, 3)
    assert falling["order"] > 0
    thin = numbers(read("step", ["thermal.h=1e-3", "thermal.body.k=1", "thermal.tca.k=1"]))
    assert thin.biot < 0.1
    assert propose(axes, thin, 1e-3)["heat"] == 0


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
    found = plane(scenes.read(scene, overrides, kept))
    assert found is None if degrees is None else math.degrees(found) == pytest.approx(degrees)


# -- ladder and measure
# -------------------------------------------------------------------------------------------------------------------


def test_every_rung_is_what_the_fmus_allow() -> None:
    """A choice made on the scene is the scene read with its settings."""
    scene = scenes.read("step", archive=kept)
    axes = ladder(scene)
    for axis in axes:
        for rung in range(len(axis.rungs)):
            choice = {**dict.fromkeys((a.name for a in axes), 0), axis.name: rung}
            lines = [f"{key}={json.dumps(value)}" for key, value in settings(scene, choice).items()]
            again, chosen = scenes.read("step", ["rod.closure=inside", *lines], kept), applied(scene, choice)
            assert [m.parameters for m in chosen.members] == [m.parameters for m in again.members]
            assert chosen.coupling == again.coupling


def test_a_choice_closes_the_loop_inside_and_has_no_level_to_choose_any_more() -> None:
    scene = read("step", ["fidelity.level=auto", "coupling.method=plain", "coupling.control=doubling"])
    found = applied(scene, dict.fromkeys((a.name for a in ladder(scene)), 0))
    assert found.asked.level == "given"
    assert found.member("rod").value("closure") == 1
    assert [str(c) for c in found.connections if c.target[0] == "rod"] == [
        f"thermal.T[{k}] -> rod.T[{k}]" for k in (1, 2, 3)
    ]
    assert (found.coupling.method, found.coupling.control) == ("plain", "fixed")


def made(values: np.ndarray, times: np.ndarray) -> xr.Dataset:
    return xr.Dataset({"rod.tip.p": (("time", "index3"), values)}, {"time": times})


def test_errors_are_shares_of_the_range() -> None:
    """A circle of radius 1 mm lies in a box of diagonal 2 sqrt(2) mm; moved by 0.1 mm at every other time."""
    fine = np.linspace(0.0, 2.0 * np.pi, 201)
    circle = 1e-3 * np.column_stack([np.cos(fine), np.sin(fine), 0.0 * fine])
    moved = circle[::10] + np.where(np.arange(21) % 2 == 0, 1e-4, 0.0)[:, None] * [0.0, 0.6, 0.8]
    found = error(made(moved, fine[::10]), made(circle, fine), {"rod.tip.p": 1e-9})
    assert found == pytest.approx(0.1 * math.sqrt(11.0 / 21.0) / math.sqrt(8.0))
    still = made(0.0 * circle, fine)
    assert error(made(0.0 * circle + 1e-6, fine), still, {"rod.tip.p": 1e-3}) == pytest.approx(math.sqrt(3.0) * 1e-3)
    assert quantities(read("step")) == {"rod.tip.p": pytest.approx(1e-5)}


# -- climb
# -------------------------------------------------------------------------------------------------------------------

AXES = tuple(Axis(name, "model", None, ({},) * 9) for name in ("heat", "inertia", "order"))


class Known:
    """Runs whose errors are known: of each axis a share of 10^-rung."""

    def __init__(self, **sizes: float) -> None:
        self.sizes, self.scene = sizes, read("step")

    def value(self, choice: dict[str, int]) -> float:
        return sum(size * 0.1 ** choice[name] for name, size in self.sizes.items())

    def gap(self, choice: dict[str, int], better: dict[str, int], stop: float) -> float:
        return abs(self.value(choice) - self.value(better))


def test_the_largest_term_climbs_and_the_rest_stays() -> None:
    runs, tried = Known(heat=1e-5, inertia=3e-4, order=5.0), []
    start = {"heat": 0, "inertia": 0, "order": 0}
    choice = climb(runs, AXES, start, 1e-2, 1.0, lambda c, e: tried.append(dict(c)))
    assert choice == {"heat": 0, "inertia": 0, "order": 3}
    assert tried[0] == start
    assert [c["order"] for c in tried] == sorted(c["order"] for c in tried)
    assert runs.value(choice) <= 1e-2
    exact = climb(runs, AXES, start, 1e-5, 1.0, lambda c, e: None)
    assert runs.value(exact) <= 1e-5
    assert exact["order"] > exact["inertia"] > exact["heat"]


def test_what_was_proposed_too_rich_comes_down() -> None:
    runs = Known(heat=1e-6, inertia=1e-6, order=5.0)
    found = descend(runs, AXES, {"heat": 4, "inertia": 3, "order": 5}, 1e-2, 1.0, lambda c, e: None)
    assert (found.choice["inertia"], found.choice["order"]) == (0, 3)
    assert found.refused["order"] > SHARE * 1e-2 >= found.estimate
    assert found.estimate == pytest.approx(runs.value(found.choice), rel=0.1)
    assert set(found.gaps) == {"heat", "inertia", "order"}
    assert above(AXES, found.choice)["order"] == 4


def test_a_tolerance_that_no_level_meets() -> None:
    short = (Axis("order", "space", None, ({},) * 3),)
    runs = Known(order=1.0)
    runs.gap = lambda choice, better, stop: 0.5
    with pytest.raises(CosimError, match=r"no level meets the tolerance 0\.001: .* off by 0\.5 of the range"):
        climb(runs, short, {"order": 0}, 1e-3, 1.0, lambda c, e: None)


# -- scenes
# -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", ["step", "switch", "sine"])
def test_the_scenes_of_the_paper_need_constant_strain_and_no_inertia(scene: str) -> None:
    result = run(read(scene, ["fidelity.level=auto", "fidelity.tolerance=1e-3"]))
    record = json.loads(result.attrs["fidelity"])
    choice, why = record["choice"], " ".join(record["reasons"])
    assert (choice["rod.dynamic"], choice["rod.order"], choice["rod.strains"]) == (False, 0, "extensible")
    assert "Quasi-static: loads grow over 3.7 s against a first period of 0.19 s" in why
    assert "no gravity, no load at the tip and parallel TCAs: equilibria are arcs exactly" in why
    budget = record["budget"]
    assert budget["estimate"] <= SHARE * budget["tolerance"] == SHARE * 1e-3
    assert budget["model"] > max(budget["time"], budget["coupling"])  # inertia, left out
    assert result.sizes["time"] == 301
    assert json.loads(result.attrs["members"])["rod"]["parameters"]["order"] == 0


# In CI the cheap ones; `tca-cosim fit SCENE... --tolerance X --study` is for all.
@pytest.mark.parametrize(
    ("scene", "tolerance", "overrides", "dynamic"),
    [
        ("step", 1e-3, [], False),
        ("drop", 1e-4, ["stop_time=0.4"], True),
        ("load", 1e-3, [], False),
        ("push", 1e-2, [], False),
        ("pulse", 1e-3, ["stop_time=1.5"], True),
    ],
)
def test_the_true_error_is_within_the_tolerance(
    scene: str, tolerance: float, overrides: list[str], dynamic: bool
) -> None:
    found = fidelity.fit(read(scene, [*overrides, f"fidelity.tolerance={tolerance}"]))
    true = fidelity.audit(found)
    assert true <= tolerance
    assert found.found.estimate == pytest.approx(true, rel=0.3)
    assert found.record()["choice"]["rod.dynamic"] is dynamic
    assert len(found.record(true)["reasons"]) == len(found.ladder)
    assert found.record(true)["budget"]["true_error"] == true


def test_other_quantities_need_other_models() -> None:
    """A temperature needs nothing of the rod: it does not act on the heat here."""
    found = fidelity.fit(read("drop", ["stop_time=0.1", 'fidelity.quantities=["thermal.T"]']))
    assert found.record()["choice"]["rod.dynamic"] is False
    assert found.record()["choice"]["rod.order"] == 0


def test_choices_are_near_the_cheapest_that_is_enough() -> None:
    found = [fidelity.fit(read("drop", ["stop_time=0.05", f"fidelity.tolerance={x}"])) for x in (1e-2, 1e-3)]
    assert len(list(candidates(found[0].ladder, [f.found.choice for f in found]))) > 90
    for tolerance, judged in zip((1e-2, 1e-3), fidelity.study(found), strict=True):
        assert judged.chosen.error <= tolerance >= judged.best.error
        assert min(level.error for level in judged.levels) < 1e-5 < 1e-1 < max(level.error for level in judged.levels)
        assert judged.best.cost <= judged.chosen.cost
        assert judged.ratio >= 1.0


# -- commands and mistakes
# -------------------------------------------------------------------------------------------------------------------


def test_commands(tmp_path: Path) -> None:
    done = tca("fit", "load", "--tolerance", "1e-2", "--set", "stop_time=2", "--audit", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Quasi-static" in done.stdout
    assert "true error" in done.stdout
    record = json.loads(results.read(tmp_path / "results" / "load.fit.nc").attrs["fidelity"])
    assert record["budget"]["true_error"] <= 1e-2
    auto = tca("run", "load", "--set", "fidelity.level=auto", "--set", "stop_time=1", folder=tmp_path)
    assert auto.returncode == 0, auto.stderr
    assert "Heat: reduced model" in auto.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["fit", "step", "--tolerance", "0"], "allowed: 1e-06 to 0.3"),
        (["fit", "step", "--tolerance", "nan"], "not finite"),
        (["fit", "step", "--tolerance", "much"], "fidelity.tolerance = 'much'"),
        (["fit", "step", "--of", "rod.tip"], "no Real output"),
        (["fit", "step", "--of", "rod.tip.p[1]"], "give the whole vector, 'rod.tip.p'"),
        (["timing", "step", "--set", "fidelity.level=auto"], "use `tca-cosim run` or `tca-cosim fit`"),
    ],
)
def test_mistakes_are_one_message(arguments: list[str], said: str) -> None:
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert said in done.output.replace("\n", " ")


def test_mistakes_in_the_table() -> None:
    for slip, said in (
        ("fidelity=3", "wants a table"),
        ("fidelity.level=some", "allowed: "),
        ("fidelity.quantities=3", "wants a list of outputs"),
        ('fidelity.quantities=["rod.T"]', "no Real output"),
        ("fidelity.tolerence=1", "did you mean 'tolerance'"),
    ):
        with pytest.raises(SceneError, match=said):
            read("step", [slip])


def test_scenes_ask_for_given_models_unless_they_say_auto() -> None:
    assert all(read(name).asked.level == "given" for name in titles())
