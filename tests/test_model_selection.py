"""Parts of model selection: hierarchies, the search on known errors, resumable runs."""

from __future__ import annotations

import contextlib
import json
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmu_maker import make_fmu, real
from tca_cosim import CosimError, read
from tca_cosim import scene as scenes
from tca_cosim.fmi.archive import cached_archive
from tca_cosim.studies import model_selection
from tca_cosim.studies.model_selection import explanation
from tca_cosim.studies.model_selection.dimensionless_numbers import (
    dimensionless_numbers,
)
from tca_cosim.studies.model_selection.hierarchy import (
    ModelHierarchy,
    apply_choice,
    choice_settings,
    model_hierarchies,
    with_required,
)
from tca_cosim.studies.model_selection.measure import Quantity, Trajectory, relative_error, requested_quantities
from tca_cosim.studies.model_selection.reference_level import reference_choice
from tca_cosim.studies.model_selection.runs import ResumableRun, RunCache
from tca_cosim.studies.model_selection.search import SHARE, SearchResult, coarsen, comparison_choice, refine

# -- hierarchies and measure -------------------------------------------------------------------------------------------


def test_every_level_is_what_the_fmus_allow() -> None:
    """A choice made on the scene is the scene read with its settings."""
    scene = scenes.read("step", archive=cached_archive)
    hierarchies = model_hierarchies(scene)
    for hierarchy in hierarchies:
        for level in range(len(hierarchy.levels)):
            choice = {**dict.fromkeys((a.name for a in hierarchies), 0), hierarchy.name: level}
            lines = [f"{key}={json.dumps(value)}" for key, value in choice_settings(scene, choice).items()]
            again, chosen = (
                scenes.read("step", ["rod.closure=inside", *lines], cached_archive),
                apply_choice(scene, choice),
            )
            assert [m.parameters for m in chosen.members] == [m.parameters for m in again.members]
            assert chosen.coupling == again.coupling


def test_a_choice_closes_the_loop_inside_and_has_no_level_to_choose_any_more() -> None:
    scene = read("step", ["fidelity.level=auto", "coupling.method=plain", "coupling.control=doubling"])
    actual = apply_choice(scene, dict.fromkeys((a.name for a in model_hierarchies(scene)), 0))
    assert actual.accuracy.level == "given"
    assert actual.member("rod").value("closure") == 1
    assert [str(c) for c in actual.connections if c.target[0] == "rod"] == [
        f"thermal.T[{k}] -> rod.T[{k}]" for k in (1, 2, 3)
    ]
    assert (actual.coupling.method, actual.coupling.control) == ("plain", "fixed")


def made(values: np.ndarray, times: np.ndarray) -> Trajectory:
    return Trajectory(times, {"rod.tip.p": values})


def least(of: float) -> dict[str, Quantity]:
    return {"rod.tip.p": Quantity("rod", ("tip.p[1]", "tip.p[2]", "tip.p[3]"), of)}


def test_errors_are_shares_of_the_range() -> None:
    """A circle of radius 1 mm lies in a box of diagonal 2 sqrt(2) mm; moved by 0.1 mm at every other time."""
    fine = np.linspace(0.0, 2.0 * np.pi, 201)
    circle = 1e-3 * np.column_stack([np.cos(fine), np.sin(fine), 0.0 * fine])
    moved = circle[::10] + np.where(np.arange(21) % 2 == 0, 1e-4, 0.0)[:, None] * [0.0, 0.6, 0.8]
    actual = relative_error(made(moved, fine[::10]), made(circle, fine), least(1e-9))
    assert actual == pytest.approx(0.1 * math.sqrt(11.0 / 21.0) / math.sqrt(8.0))
    still = made(0.0 * circle, fine)
    assert relative_error(made(0.0 * circle + 1e-6, fine), still, least(1e-3)) == pytest.approx(math.sqrt(3.0) * 1e-3)
    assert requested_quantities(read("step")) == least(pytest.approx(1e-5))


# -- refine ------------------------------------------------------------------------------------------------------------

HIERARCHIES = tuple(ModelHierarchy(name, "model", None, ({},) * 9) for name in ("heat", "inertia", "order"))


class Known:
    """Runs whose errors are known: of each hierarchy a share of 10^-level. costs: CPU time of every run [s]."""

    def __init__(self, costs: float = 0.0, **sizes: float) -> None:
        self.costs, self.sizes, self.scene = costs, sizes, read("step")

    def cost(self, choice: dict[str, int]) -> float:
        return self.costs

    def value(self, choice: dict[str, int]) -> float:
        return sum(size * 0.1 ** choice[name] for name, size in self.sizes.items())

    def difference(self, choice: dict[str, int], better: dict[str, int], stop: float, limit: float = math.inf) -> float:
        return abs(self.value(choice) - self.value(better))


def test_the_largest_term_is_refined_and_the_rest_stays() -> None:
    runs, tried = Known(heat=1e-5, inertia=3e-4, order=5.0), []
    start = {"heat": 0, "inertia": 0, "order": 0}
    choice = refine(runs, HIERARCHIES, start, 1e-2, 1.0, lambda c, e: tried.append(dict(c)))
    assert choice == {"heat": 0, "inertia": 0, "order": 3}
    assert tried[0] == start
    assert [c["order"] for c in tried] == sorted(c["order"] for c in tried)
    assert runs.value(choice) <= 1e-2
    exact = refine(runs, HIERARCHIES, start, 1e-5, 1.0, lambda c, e: None)
    assert runs.value(exact) <= 1e-5
    assert exact["order"] > exact["inertia"] > exact["heat"]


def test_what_was_proposed_too_rich_comes_down() -> None:
    runs = Known(heat=1e-6, inertia=1e-6, order=5.0)
    actual = coarsen(runs, HIERARCHIES, {"heat": 4, "inertia": 3, "order": 5}, 1e-2, 1.0, lambda c, e: None)
    assert (actual.choice["inertia"], actual.choice["order"]) == (0, 3)
    assert actual.rejected["order"] > SHARE * 1e-2 >= actual.estimate
    assert actual.estimate == pytest.approx(runs.value(actual.choice), rel=0.1)
    assert set(actual.gaps) == {"heat", "inertia", "order"}
    assert comparison_choice(HIERARCHIES, actual.choice)["order"] == 4


@pytest.mark.parametrize(("moved", "lowered"), [(1.0, (1, 2)), (0.0, (0, 5))])
def test_time_steps_come_down_where_there_are_any(moved: float, lowered: tuple[int, int]) -> None:
    """Waves that nothing damps make them dear; an equilibrium takes none."""
    hierarchies = (
        ModelHierarchy("inertia", "model", None, ({},) * 2, complete=True),
        ModelHierarchy("step", "time", None, ({},) * 9),
    )
    runs = Known(inertia=moved, step=0.1)
    actual = coarsen(runs, hierarchies, {"inertia": 1, "step": 5}, 1e-2, 1.0, lambda c, e: None)
    assert (actual.choice["inertia"], actual.choice["step"]) == lowered


def test_a_tolerance_that_no_level_meets() -> None:
    short = (ModelHierarchy("order", "space", None, ({},) * 3),)
    runs, tried = Known(order=1.0), []
    runs.difference = lambda choice, better, stop: 0.5
    with pytest.raises(CosimError, match=r"no level meets the tolerance 0\.001: .* off by 0\.5 of the range"):
        refine(runs, short, {"order": 0}, 1e-3, 1.0, lambda c, e: tried.append(c["order"]))
    assert tried == [0, 1]  # level 2 is there for comparison only


def test_hierarchies_are_those_of_the_models_that_a_scene_has(tmp_path: Path) -> None:
    whole = {h.name for h in model_hierarchies(read("step")) if h.model is not None}
    heat = {"fmus": {"thermal": "thermal.fmu"}, "connections": [], "stop_time": 1.0}
    actual = {h.name: h.model for h in model_hierarchies(read(heat))}
    assert {model for model in actual.values() if model} == {"thermal"}
    assert {name for name, model in actual.items() if model} < whole
    assert "macro" in actual
    make_fmu(tmp_path / "thermal.fmu", [real("u", "input", start=0), real("y")])  # of that name, without its settings
    other = {**heat, "fmus": {"thermal": str(tmp_path / "thermal.fmu")}}
    assert not [h.name for h in model_hierarchies(read(other)) if h.model is not None]


def test_planar_models_come_before_spatial_ones_in_the_plane_of_symmetry() -> None:
    (plane,) = (h for h in model_hierarchies(read("drop")) if h.name == "plane")
    assert [level["planar"] for level in plane.levels] == [True, False]
    assert len({level["plane"] for level in plane.levels}) == 1


def test_what_no_run_can_tell_is_not_known() -> None:
    """A choice that is good enough stays one where a model that was not chosen cannot be run."""
    runs = Known(heat=1e-6, inertia=1e-6, order=5.0)

    def difference(choice: dict[str, int], better: dict[str, int], stop: float, limit: float = math.inf) -> float:
        if better["heat"] > choice["heat"] and better["order"] == choice["order"]:
            raise CosimError("a finer heat fails")
        return Known.difference(runs, choice, better, stop)

    runs.difference = difference
    actual = coarsen(runs, HIERARCHIES, {"heat": 0, "inertia": 3, "order": 3}, 1e-2, 1.0, lambda c, e: None)
    assert math.isnan(actual.gaps["heat"])
    assert 0.0 < actual.gaps["order"] < 1e-2
    said = model_selection.select(read("load", ["stop_time=0.2"]))
    unknown = replace(said.search, gaps={**said.search.gaps, "heat": 0.0, "macro": math.nan})
    text = replace(said, search=unknown).result(true=math.inf).attrs["fidelity"]
    record = json.loads(text, parse_constant=lambda word: pytest.fail(word))
    assert (record["budget"]["coupling"], record["budget"]["true_error"]) == (None, None)
    assert record["budget"]["space"] is not None
    assert "how much half of it would change is not known" in record["reasons"][-1]


def test_what_errors_are_measured_against() -> None:
    """The finer of the first two time steps that agree to 2 % of the tolerance; the last of everything else."""
    hierarchies = (ModelHierarchy("order", "space", None, ({},) * 8), ModelHierarchy("step", "time", None, ({},) * 10))
    hierarchies += (ModelHierarchy("macro", "coupling", None, ({},) * 8),)
    runs = Known(step=1.0)
    low, high = ({"order": 1, "step": step, "macro": 1} for step in (2, 7))
    assert reference_choice(runs, hierarchies, [low], 1e-3) == {"order": 7, "step": 6, "macro": 3}
    assert reference_choice(runs, hierarchies, [low], 1e-5) == {"order": 7, "step": 8, "macro": 3}
    assert reference_choice(runs, hierarchies, [low, high], 1e-3) == {"order": 7, "step": 9, "macro": 3}
    assert reference_choice(runs, hierarchies, [low], 1e-9) == {"order": 7, "step": 9, "macro": 3}


@pytest.mark.parametrize(("levels", "compared"), [(1, 0), (2, 0), (6, 3)])
def test_time_steps_are_compared_with_a_coarser_heat(levels: int, compared: int) -> None:
    """Two levels coarser than the finest, where there are as many; the reference itself has the finest."""
    hierarchies = tuple(
        ModelHierarchy(name, "", None, ({},) * count) for name, count in (("heat", levels), ("step", 10), ("macro", 8))
    )
    runs, heats = Known(step=1.0), set()

    def difference(coarse: dict[str, int], fine: dict[str, int], stop: float) -> float:
        heats.update((coarse["heat"], fine["heat"]))
        return Known.difference(runs, coarse, fine, stop)

    runs.difference = difference
    actual = reference_choice(runs, hierarchies, [{"heat": 0, "step": 2, "macro": 1}], 1e-3)
    assert heats == {compared}
    assert actual["heat"] == levels - 1


@pytest.mark.parametrize(("name", "arcs"), [("step", True), ("load", False)])
def test_reasons_say_whether_equilibria_are_arcs(name: str, arcs: bool) -> None:
    numbers = dimensionless_numbers(read(name))
    said = explanation._order({"order": 0}, SearchResult({}, 0.0, {"order": 0.0}, {}), numbers)
    assert ("equilibria are arcs exactly" in said) is arcs
    assert ("gravity number" in said) is not arcs
    pushed = explanation._order(
        {"order": 0}, SearchResult({}, 0.0, {"order": 0.0}, {}), replace(numbers, loaded_by_others=True)
    )
    assert "other FMUs push it" in pushed


# -- runs --------------------------------------------------------------------------------------------------------------


MANY = "coupling.macro_step=2e-5"  # steps of a run: so many that blocks of them (fmi/block_steps.py) end within it


def test_a_run_goes_on_where_it_was() -> None:
    scene = read("drop", ["stop_time=0.1", MANY])
    choice = dict.fromkeys((hierarchy.name for hierarchy in model_hierarchies(scene)), 0)
    with (
        contextlib.closing(ResumableRun(apply_choice(scene, choice))) as whole,
        contextlib.closing(RunCache(scene)) as runs,
    ):
        begin = time.thread_time()
        assert not whole.advance_to(0.1, limit=0.0)
        assert 0.0 < whole.cost <= time.thread_time() - begin
        assert whole.result.sizes["time"] < 1000  # stopped behind the first block
        assert whole.advance_to(0.1)
        early = runs(choice, 0.04).trajectory(runs.quantities, 0.04)
        again = runs(choice, 0.1).result.to_xarray()
        assert again.drop_attrs(deep=False).identical(
            whole.result.to_xarray().drop_attrs(deep=False)
        )  # timings are in attributes
        assert runs.count == 1
        assert early.times[-1] == pytest.approx(0.04)
        again = runs(choice, 0.04).trajectory(runs.quantities, 0.04)
        np.testing.assert_array_equal(again.values["rod.tip.p"], early.values["rod.tip.p"])


def test_a_run_that_is_clearly_too_coarse_ends_early() -> None:
    """Its error until then is above the limit for the whole; a run within the limit goes to the end."""
    scene = read("drop", ["stop_time=0.2", "coupling.macro_step=5e-5"])
    choice = dict.fromkeys((hierarchy.name for hierarchy in model_hierarchies(scene)), 0) | {"step": 3}
    fine = {**choice, "inertia": 1, "strains": 3, "order": 3}
    with contextlib.closing(RunCache(scene)) as runs:
        part = runs.difference(choice, fine, 0.2, 1e-3)
        assert len(runs(choice, 0.0).trajectory(runs.quantities, 0.2).times) < 0.5 * len(
            runs(fine, 0.2).trajectory(runs.quantities, 0.2).times
        )
        assert part > 1e-3
        whole = runs.difference(choice, fine, 0.2)
        assert whole > 1e-3
        assert runs.difference(choice, fine, 0.2, 2.0 * whole) == whole


def test_a_run_that_takes_too_long_ends_the_search() -> None:
    scene = read("drop", ["stop_time=0.1", MANY])
    choice = dict.fromkeys((hierarchy.name for hierarchy in model_hierarchies(scene)), 0)
    with contextlib.closing(RunCache(scene, limit=0.0, words=lambda choice: "the coarsest")) as runs:
        with pytest.raises(CosimError, match=r"run 1 takes too long: .* of 0\.1 s \(the coarsest\).*macro_step = "):
            runs(choice, 0.1)
        runs.limit = math.inf
        assert runs(choice, 0.1).ended


def test_what_was_negligible_is_not_measured_again() -> None:
    runs, asked = Known(heat=1e-6, inertia=1e-6, order=5.0), []

    def difference(choice: dict[str, int], better: dict[str, int], stop: float, limit: float = math.inf) -> float:
        asked.extend(h for h in choice if better == {**choice, h: choice[h] + 1})
        return Known.difference(runs, choice, better, stop)

    runs.difference = difference
    start = {"heat": 0, "inertia": 0, "order": 0}
    assert refine(runs, HIERARCHIES, start, 1e-2, 1.0, lambda c, e: None)["order"] == 3
    assert asked.count("heat") == asked.count("inertia") == 1 < asked.count("order")


class Made(Known):
    """Known runs of which only those cost something that were made."""

    def __init__(self, **known: float) -> None:
        super().__init__(**known)
        self.made: list[dict[str, int]] = []

    def cost(self, choice: dict[str, int]) -> float:
        return self.costs if choice in self.made else 0.0

    def difference(self, choice: dict[str, int], better: dict[str, int], stop: float, limit: float = math.inf) -> float:
        self.made += [each for each in (choice, better) if each not in self.made]
        return super().difference(choice, better, stop)


@pytest.mark.parametrize(("costs", "measured"), [(0.1, {"heat", "inertia", "order"}), (0.3, {"heat"}), (2.0, set())])
def test_contributions_are_measured_where_runs_are_cheap(costs: float, measured: set[str]) -> None:
    """They only explain a choice; where all runs are long, its estimate is what is said of them."""
    runs = Made(costs=costs, heat=1e-3, inertia=1e-3, order=1e-3)
    choice = {"heat": 0, "inertia": 0, "order": 0}
    found = coarsen(runs, HIERARCHIES, choice, 1e-2, 1.0, lambda c, e: None)
    assert set(found.gaps) == measured
    assert len(runs.made) == 2 + len(measured)
    said = explanation._adds(found, "order", "two orders more")
    assert ("was not measured, since such runs take long" in said) is ("order" not in measured)


def test_what_needs_many_more_macro_steps_is_not_measured_to_explain() -> None:
    hierarchies = (
        ModelHierarchy("inertia", "model", None, ({},) * 2, complete=True, requires={"macro": 5}),
        ModelHierarchy("macro", "coupling", None, ({},) * 8),
        ModelHierarchy("order", "space", None, ({},) * 8),
    )
    runs = Made(costs=0.1, inertia=1e-3, macro=1e-3, order=1e-3)
    found = coarsen(runs, hierarchies, dict.fromkeys(("inertia", "macro", "order"), 0), 1e-2, 1.0, lambda c, e: None)
    assert set(found.gaps) == {"macro", "order"}


def test_a_level_can_require_levels_of_others() -> None:
    """Inertia at a tip that others push back needs macro steps that resolve what comes of it."""
    inertia = ModelHierarchy("inertia", "model", None, ({},) * 2, complete=True, requires={"macro": 4})
    hierarchies = (inertia, ModelHierarchy("macro", "coupling", None, ({},) * 8))
    assert with_required(hierarchies, {"inertia": 0, "macro": 0}) == {"inertia": 0, "macro": 0}
    assert with_required(hierarchies, {"inertia": 1, "macro": 0}) == {"inertia": 1, "macro": 4}
    assert comparison_choice(hierarchies, {"inertia": 0, "macro": 0}) == {"inertia": 1, "macro": 4}
    assert comparison_choice(hierarchies, {"inertia": 1, "macro": 4}) == {"inertia": 1, "macro": 5}
    runs = Known(inertia=1.0)
    assert reference_choice(runs, hierarchies, [{"inertia": 0, "macro": 0}], 1e-3) == {"inertia": 1, "macro": 6}
    assert refine(runs, hierarchies, {"inertia": 0, "macro": 0}, 1e-3, 1.0, lambda c, e: None)["macro"] == 4


def test_a_run_that_fails_is_infinitely_far_off(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = read("drop", ["stop_time=0.02"])
    choice = dict.fromkeys((hierarchy.name for hierarchy in model_hierarchies(scene)), 0)
    with contextlib.closing(RunCache(scene)) as runs:
        assert math.isfinite(runs.difference(choice, {**choice, "order": 1}, 0.02))
        monkeypatch.setattr("tca_cosim.studies.model_selection.runs.relative_error", lambda *courses: math.nan)
        assert runs.difference(choice, {**choice, "order": 1}, 0.02) == math.inf
