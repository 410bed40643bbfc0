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
from tca_cosim.studies.model_selection.proposal import propose_choice
from tca_cosim.studies.model_selection.runs import RunCache
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
    """w H = 1 for w = w1 sqrt(1 + k c), so fourfold stiffness takes one halving more.

    Held forces require nothing, nor do scenes without such a loop.
    """
    linear = "coupling.waveform=linear"
    once = resolved("gripper", linear)["macro"]
    assert 0.5 < 0.5**once * 3.3 * math.sqrt(34.0) <= 1.0  # gain 33 at constant bending
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


@pytest.mark.parametrize(("tolerance", "dynamic"), [(1e-2, False), (1e-3, True)])
def test_models_of_the_gripper(tolerance: float, dynamic: bool) -> None:
    """Its true error, against models that are finer in everything; `tca-cosim select gripper --audit` takes minutes."""
    scene = read("gripper", [f"fidelity.tolerance={tolerance}", "fidelity.search=anew", "stop_time=4"])
    actual = model_selection.select(scene)
    choice = actual.search.choice
    assert bool(choice["inertia"]) is dynamic
    fine = {**choice, "heat": 2, "strains": 3, "inertia": 1, "order": 4, "step": 3, "macro": 3}
    error = actual.runs.difference(choice, fine, 4.0)
    actual.runs.close()
    assert error <= tolerance
