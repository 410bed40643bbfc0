"""Selection of models where a contact pushes back at the tip, and runs with fingers that have inertia."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Mapping

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim import read
from tca_cosim.cosim.ringing import turning_share
from tca_cosim.studies import model_selection
from tca_cosim.studies.model_selection.dimensionless_numbers import dimensionless_numbers
from tca_cosim.studies.model_selection.hierarchy import ModelHierarchy, model_hierarchies
from tca_cosim.studies.model_selection.macro_step_search import search_macro_step_last
from tca_cosim.studies.model_selection.proposal import propose_choice
from tca_cosim.studies.model_selection.runs import RunCache
from tca_cosim.studies.model_selection.search import SHARE
from tca_cosim.studies.model_selection.stiff_loops import resolve_stiff_loop, search_stiff_loop

DYNAMIC = {"left.dynamic": True, "right.dynamic": True, "left.order": 2, "right.order": 2, "stop_time": 2.0}


@pytest.mark.parametrize("step", [0.1, 0.05, 0.025])
def test_fingers_with_inertia_squeeze_at_macro_steps_longer_than_the_contact_swings(step: float) -> None:
    """Contact alone swings at 2 pi/20 ms. Held forces take energy at every macro step, so nothing grows; both fingers
    end where short steps lead."""
    fine = tca.run("gripper", {**DYNAMIC, "coupling.macro_step": 0.0125})
    actual = tca.run("gripper", {**DYNAMIC, "coupling.macro_step": step})
    for name in ("left.tip.p", "right.tip.p"):
        reference = fine[name].to_numpy()
        at = np.rint(actual["time"].to_numpy() / 0.0125).astype(int)
        span = np.linalg.norm(np.ptp(reference, axis=0))
        error = np.sqrt(((actual[name].to_numpy() - reference[at]) ** 2).sum(axis=1).mean()) / span
        assert error < 2e-3


def test_linear_forces_ring_with_steps_that_do_not_resolve_the_contact_and_the_result_says_so() -> None:
    """The remedies of the note work: held forces, or steps that resolve it."""

    def noted(**coupling: object) -> list[str]:
        loose = {"left.tolerance": 1e-3, "right.tolerance": 1e-3}
        result = tca.run("gripper", {**DYNAMIC, **loose, **{f"coupling.{key}": v for key, v in coupling.items()}})
        return [note for note in json.loads(result.attrs["notes"]) if "turns back" in note]

    (note,) = noted(waveform="linear", macro_step=0.0125)
    assert "object.force_" in note
    assert "make coupling.macro_step shorter, or try coupling.waveform = 'held'" in note
    assert not noted(waveform="held", macro_step=0.0125)
    assert not noted(waveform="linear", macro_step=0.00625)


def test_values_ring_where_they_turn_back_in_many_steps() -> None:
    """A vibration of twelve steps a period turns back in a sixth of them, but by less than a tenth of its range there;
    noise that is small beside the range does not count, nor do a few turns after an event."""
    steps = np.arange(101)
    ring, wave, noise, few = (
        (-1.0) ** steps,
        np.sin(2 * np.pi * (steps + 0.1) / 12),
        steps + (-1.0) ** steps,
        0.0 * steps,
    )
    few[50:54] = 1.0, -1.0, 1.0, -1.0
    values = np.column_stack([ring, wave, noise, few, 0.0 * steps])
    np.testing.assert_allclose(turning_share(values), [0.99, 0.0, 0.0, 0.0, 0.0])
    assert not turning_share(values[:3]).any()


@pytest.mark.parametrize("waveform", ["held", "linear"])
def test_stability_of_a_mass_on_a_stiffness_that_is_exchanged(waveform: str) -> None:
    """Step matrix of x'' = f/m, f = -k x at the ends of steps (docs/theory/coupling.md), for k H^2/m = 0.1 to 1e4."""
    for kappa in np.geomspace(0.1, 1e4, 41):
        # x + y + c f0 + (1/2 - c) f1 = x1 with f = -kappa x and y = H v; c: weight of the old force.
        c, d = (1.0 / 3.0, 0.5) if waveform == "linear" else (0.0, 0.0)
        row = np.array([1.0 - kappa * c, 1.0]) / (1.0 + kappa * (0.5 - c))
        speed = np.array([0.0, 1.0]) - kappa * (d * np.array([1.0, 0.0]) + (1.0 - d) * row)
        radius = np.abs(np.linalg.eigvals([row, speed])).max()
        if waveform == "held":
            assert radius < 1.0
        else:
            assert bool(radius > 1.0 + 1e-6) is bool(kappa > 12.0)


def resolved(name: str, *overrides: str) -> Mapping[str, int]:
    """Levels that inertia requires of other hierarchies."""
    scene = read(name, ["stop_time=4", "fidelity.tolerance=1e-2", *overrides])
    hierarchies, numbers = model_hierarchies(scene), dimensionless_numbers(scene)
    choice = propose_choice(hierarchies, numbers, 1e-2)
    with contextlib.closing(RunCache(scene)) as runs:
        found = resolve_stiff_loop(runs, hierarchies, numbers, choice, 4.0)
    return next(h.requires for h in found if h.name == "inertia")


def test_linear_forces_of_contact_require_short_macro_steps() -> None:
    """w H = 1.5 at most for w = w1 sqrt(1 + k c), so fourfold stiffness takes one halving more.

    Held forces require nothing, nor do scenes without such a loop.
    """
    linear = "coupling.waveform=linear"
    once = resolved("gripper", linear)["macro"]
    assert 0.75 < 0.5**once * 3.3 * math.sqrt(34.0) <= 1.5  # gain 33 at constant bending
    assert resolved("gripper", linear, "object.stiffness=400")["macro"] == once + 1
    assert not resolved("gripper")
    assert not resolved("step", linear)


class Runs:
    """Runs whose errors are known: inertia matters by `moved`, and is wrong where macro steps do not resolve it."""

    def __init__(self, moved: float) -> None:
        self.moved, self.scene = moved, read("step")

    def cost(self, choice: Mapping[str, int]) -> float:
        return 10.0

    def difference(
        self, choice: Mapping[str, int], finer: Mapping[str, int], stop: float, limit: float = math.inf
    ) -> float:
        return math.dist(self.place(choice), self.place(finer))

    def first_parts_differ(
        self, choice: Mapping[str, int], finer: Mapping[str, int], stop: float, limit: float, like: Mapping[str, int]
    ) -> bool:
        return self.difference(choice, finer, stop) > limit

    def place(self, choice: Mapping[str, int]) -> tuple[float, ...]:
        assert not choice["inertia"] or choice["macro"] >= 5, "a run that rings"
        return self.moved * choice["inertia"], 0.1 ** choice["order"], 1e-3 * 0.1 ** choice["macro"]


@pytest.mark.parametrize(("moved", "chosen"), [(1e-4, (0, 0)), (5e-2, (1, 5))])
def test_quasi_static_models_come_first_and_inertia_only_with_steps_that_resolve_it(
    moved: float, chosen: tuple[int, int]
) -> None:
    hierarchies = (
        ModelHierarchy("inertia", "model", None, ({},) * 2, complete=True, requires={"macro": 5}),
        ModelHierarchy("order", "space", None, ({},) * 8, 2),
        ModelHierarchy("macro", "coupling", None, ({},) * 10),
    )
    start = dict.fromkeys(("inertia", "order", "macro"), 0)
    found = search_stiff_loop(Runs(moved), hierarchies, start, 1e-2, 0.4, 1.0, lambda choice, error: None)
    assert (found.choice["inertia"], found.choice["macro"]) == chosen
    assert found.estimate <= 7e-3
    assert ("inertia" in found.rejected) is bool(chosen[0])


class HalvedRuns:
    """Runs whose errors are known: 0.1 per order, and those of a macro step of order p = 1 or 2, all independent.

    Attributes
    ----------
    finest : dict of int to int
        Finest macro step of runs that were made to the end, by order.
    """

    def __init__(self, waveform: str, model_at_short_steps: float = 0.0) -> None:
        self.scene = read("step", [f"coupling.waveform={waveform}"])
        self.ratio = 2.0**self.scene.coupling.torn.order
        self.short = model_at_short_steps
        self.finest: dict[int, int] = {}

    def cost(self, choice: Mapping[str, int]) -> float:
        return 10.0

    def difference(
        self, choice: Mapping[str, int], finer: Mapping[str, int], stop: float, limit: float = math.inf
    ) -> float:
        for each in (choice, finer):
            self.finest[each["order"]] = max(self.finest.get(each["order"], 0), each["macro"])
        return math.dist(self.place(choice), self.place(finer))

    def first_parts_differ(
        self, choice: Mapping[str, int], finer: Mapping[str, int], stop: float, limit: float, like: Mapping[str, int]
    ) -> bool:
        assert like["macro"] == 0
        return math.dist(self.place(choice), self.place(finer)) > limit

    def place(self, choice: Mapping[str, int]) -> tuple[float, float, float]:
        grown = self.short * 0.1 ** choice["order"] if choice["macro"] >= 2 else 0.0
        return 0.1 ** choice["order"], 0.3 * self.ratio ** -choice["macro"], grown


ORDER_AND_STEP = (
    ModelHierarchy("order", "space", None, ({},) * 8, 2),
    ModelHierarchy("macro", "coupling", None, ({},) * 16),
)


@pytest.mark.parametrize("waveform", ["held", "linear"])
@pytest.mark.parametrize("tolerance", [0.5, 3e-2, 2e-3, 3e-4])
def test_the_macro_step_comes_last_and_its_error_is_that_of_its_order(waveform: str, tolerance: float) -> None:
    """The true error is within the tolerance, with the longest macro step or half of it; finer models are run with
    macro steps that are no shorter."""
    runs, start = HalvedRuns(waveform), {"order": 0, "macro": 0}
    found = search_macro_step_last(runs, ORDER_AND_STEP, start, tolerance, 0.4, 1.0, lambda choice, error: None)
    error = math.hypot(*runs.place(found.choice))
    assert error <= found.estimate <= tolerance
    if found.choice["macro"] > 1:
        assert math.hypot(*runs.place({**found.choice, "macro": found.choice["macro"] - 2})) > SHARE * tolerance
    assert runs.finest.pop(found.choice["order"]) <= found.choice["macro"] + 1
    assert max(runs.finest.values()) <= found.choice["macro"]


def test_models_that_matter_with_short_macro_steps_alone_are_found_too() -> None:
    """What the order lacks grows tenfold where macro steps are short, as a vibration that long ones suppress."""
    runs, start = HalvedRuns("held", 10.0), {"order": 0, "macro": 0}
    found = search_macro_step_last(runs, ORDER_AND_STEP, start, 5e-3, 0.4, 1.0, lambda choice, error: None)
    assert math.hypot(*runs.place(found.choice)) <= 5e-3
    long = HalvedRuns("held")
    alone = search_macro_step_last(long, ORDER_AND_STEP, start, 5e-3, 0.4, 1.0, lambda choice, error: None)
    assert found.choice["order"] == alone.choice["order"] + 1


def test_runs_that_part_after_the_window_are_told() -> None:
    runs = HalvedRuns("held")
    agree = runs.difference
    runs.difference = lambda choice, finer, stop, limit=math.inf: 0.8 if stop > 0.4 else agree(choice, finer, stop)
    with pytest.raises(tca.CosimError, match=r"agree until t = 0.4 s .* by 80% .* such as tip_force\[2\] of a rod"):
        search_macro_step_last(
            runs, ORDER_AND_STEP, {"order": 0, "macro": 0}, 3e-2, 0.4, 1.0, lambda choice, error: None
        )


def test_a_small_load_chooses_the_side_that_a_finger_buckles_to() -> None:
    """At 3.5 V the left finger leaves the plane at 12 s, to a side that rounding chooses."""
    loads = ["left.tip_force[2]=1e-5 N", "right.tip_force[2]=1e-5 N", "left_heat.V[1]=3.5 V", "right_heat.V[1]=3 V"]
    chosen = model_selection.select(read("gripper", [*loads, "stop_time=14", "fidelity.tolerance=1e-2"]))
    assert chosen.search.estimate <= 1e-2
    assert abs(chosen.run.result.to_xarray()["left.tip.p"][-1, 1]) > 5e-3


@pytest.mark.parametrize(("tolerance", "dynamic"), [(1e-2, False), (1e-3, True), (1e-4, True)])
def test_models_of_the_gripper(tolerance: float, dynamic: bool) -> None:
    """Its true error, against models that are finer in everything; `tca-cosim select gripper --audit` takes minutes."""
    scene = read("gripper", [f"fidelity.tolerance={tolerance}", "fidelity.search=anew", "stop_time=4"])
    actual = model_selection.select(scene)
    choice = actual.search.choice
    assert bool(choice["inertia"]) is dynamic
    finer = {"heat": 3, "strains": 3, "inertia": 1, "order": choice["order"] + 2, "step": 3}
    fine = {**choice, **finer, "macro": max(choice["macro"] + 1, 3)}
    error = actual.runs.difference(choice, fine, 4.0)
    actual.runs.close()
    assert error <= tolerance
