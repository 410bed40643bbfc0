"""Parts of model selection on their own: sentences of an explanation, errors of trajectories, envelopes, candidates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
from tca_cosim.studies.model_selection import explanation
from tca_cosim.studies.model_selection.cost_study import candidates
from tca_cosim.studies.model_selection.dimensionless_numbers import (
    DimensionlessNumbers,
    dimensionless_numbers,
    residual_envelope,
    residual_vibration,
)
from tca_cosim.studies.model_selection.hierarchy import ModelHierarchy
from tca_cosim.studies.model_selection.kept_choice import _code
from tca_cosim.studies.model_selection.measure import Quantity, Trajectory, relative_error
from tca_cosim.studies.model_selection.proposal import propose_choice
from tca_cosim.studies.model_selection.search import SearchResult

NUMBERS = DimensionlessNumbers(
    biot=0.2, shear=0.03, extension=0.01, gravity=2.0, tip=0.5, ramp=0.25, frequency=4.0, parallel=False
)


def search(**gaps: float) -> SearchResult:
    return SearchResult({}, 0.0, gaps, {"inertia": 0.02})


def said(name: str, level: dict[str, Any], gap: float, numbers: DimensionlessNumbers = NUMBERS) -> str:
    hierarchy = ModelHierarchy(name, "", None, (level,))
    outcome = SearchResult({name: 0}, 0.0, {name: gap}, {"inertia": 0.02})
    [sentence] = explanation.reasons((hierarchy,), outcome, numbers)
    return sentence


@pytest.mark.parametrize(
    ("name", "level", "gap", "sentence"),
    [
        (
            "step",
            {"tolerance": 1e-4},
            2e-3,
            "Rod solver: relative tolerance 1e-04; a tenth of it would move the answer by 2.0e-03 of its range.",
        ),
        (
            "step",
            {"tolerance": 1e-4},
            1e-10,
            "Rod solver: relative tolerance 1e-04; a tenth of it would change nothing.",
        ),
        (
            "macro",
            {"macro_step": 1.0},
            math.nan,
            "Macro step: the scene's own, the TCAs' loop closed inside the rod; how much half of it would change "
            "is not "
            "known: a run that would tell fails.",
        ),
        (
            "macro",
            {"macro_step": 0.25},
            1e-3,
            "Macro step: the scene's own over 4, the TCAs' loop closed inside the rod; half of it would move the "
            "answer by "
            "1.0e-03 of its range.",
        ),
        (
            "strains",
            {"strains": "cosserat"},
            0.0,
            "Strains: all six strains. Shear number 0.03, extension number 0.01; all there are.",
        ),
        (
            "strains",
            {"strains": "bending"},
            0.0,
            "Strains: bending alone. Shear number 0.03, extension number 0.01; all six would change nothing.",
        ),
        (
            "order",
            {"order": 2},
            1e-3,
            "Strains of degree 2 along the rod: gravity number 2, tip load number 0.5, TCAs not parallel; two "
            "orders more "
            "would move the answer by 1.0e-03 of its range.",
        ),
        (
            "order",
            {"order": 0},
            1e-3,
            "Constant strain (order 0): gravity number 2, tip load number 0.5, TCAs not parallel; two orders "
            "more would "
            "move the answer by 1.0e-03 of its range.",
        ),
        (
            "inertia",
            {"dynamic": False},
            1e-3,
            f"Quasi-static: loads grow over 0.25 s against a first period of 0.25 s, which leaves a vibration of "
            f"at most "
            f"{1.0 / math.pi:.2g} of the deflection; inertia would move the answer by 1.0e-03 of its range.",
        ),
        (
            "inertia",
            {"dynamic": True},
            0.0,
            f"Dynamic: loads grow over 0.25 s against a first period of 0.25 s, which leaves a vibration of at most "
            f"{1.0 / math.pi:.2g} of the deflection; without inertia the answer would be off by 2.0e-02 of its range.",
        ),
        (
            "heat",
            {"level": "lumped"},
            1e-3,
            "Heat: a network of few nodes. Biot number 0.2: no uniform section; the next finer one would move "
            "the answer "
            "by 1.0e-03 of its range.",
        ),
        (
            "heat",
            {"level": "reduced", "tolerance": 1e-5},
            0.0,
            "Heat: reduced model to 1e-05. Biot number 0.2: no uniform section; the next finer one would change "
            "nothing.",
        ),
        (
            "plane",
            {"planar": True, "plane": math.pi / 3},
            0.0,
            "Planar: TCAs, heat and loads mirror in the plane at azimuth 60 deg; leaving it would change nothing.",
        ),
        (
            "plane",
            {"planar": False, "plane": math.pi / 3},
            0.0,
            "Spatial: TCAs, heat and loads mirror in the plane at azimuth 60 deg, and yet the rod leaves it.",
        ),
    ],
)
def test_sentences(name: str, level: dict[str, Any], gap: float, sentence: str) -> None:
    assert said(name, level, gap) == sentence


def test_sentences_of_sudden_loads_and_of_none() -> None:
    sudden = DimensionlessNumbers(ramp=0.0, frequency=2.0)
    text = said("inertia", {"dynamic": True}, 0.0, sudden)
    assert text.startswith(
        "Dynamic: loads grow at once against a first period of 0.5 s, which leaves a vibration of at"
    )
    none = said("inertia", {"dynamic": False}, 0.0, DimensionlessNumbers())
    assert none == "Quasi-static: no load grows, so none leaves a vibration; inertia would change nothing."
    arcs = said("order", {"order": 0}, 0.0, DimensionlessNumbers())
    assert arcs.startswith(
        "Constant strain (order 0): no gravity, no load at the tip and parallel TCAs: equilibria are"
    )
    thin = said("heat", {"level": "lumped"}, 0.0, DimensionlessNumbers(biot=0.05))
    assert "Biot number 0.05: one temperature per section" in thin
    assert said("heat", {"frozen": True}, 0.0).startswith("Heat: at rest, never stepped.")


def test_a_choice_in_a_few_words() -> None:
    levels = {
        "heat": {"level": "reduced", "tolerance": 1e-3},
        "strains": {"strains": "kirchhoff"},
        "plane": {"planar": False},
        "inertia": {"dynamic": True},
        "order": {"order": 3},
        "step": {"tolerance": 1e-6},
        "macro": {"macro_step": 0.5},
    }
    hierarchies = tuple(ModelHierarchy(name, "", None, (level,)) for name, level in levels.items())
    assert explanation.summary(hierarchies, dict.fromkeys(levels, 0)) == (
        "heat to 1e-03, bending, stretch and twist, spatial, dynamic, order 3, rod to 1e-06, macro step / 2"
    )


# -- errors of trajectories


def curve(times: list[float], values: list[float]) -> Trajectory:
    return Trajectory(np.array(times), {"x": np.array(values)[:, None]})


def error(a: Trajectory, b: Trajectory, **quantity: Any) -> float:
    return relative_error(a, b, {"x": Quantity("m", ("x",), quantity.pop("least", 1e-9), **quantity)})


def test_errors_are_taken_at_common_times() -> None:
    fine = curve([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, 2.0, 3.0, 4.0])
    assert error(curve([0.0, 2.0, 4.0], [0.0, 2.0, 5.0]), fine) == pytest.approx(math.sqrt(1.0 / 3.0) / 4.0)
    assert error(curve([0.0, 1.5, 4.0], [0.0, 99.0, 5.0]), fine) == pytest.approx(math.sqrt(1.0 / 2.0) / 4.0)
    assert error(curve([0.0, 1.0 + 3e-9, 4.0], [0.0, 1.0, 4.0]), fine) == 0.0
    assert error(curve([0.0, 1.0 + 5e-9, 4.0], [0.0, 99.0, 4.0]), fine) == 0.0  # no common time any more
    assert error(curve([0.0, 1.0 - 3e-9, 4.0], [0.0, 3.0, 4.0]), fine) > 0.1


def test_errors_of_what_hardly_moves_are_shares_of_the_least_range() -> None:
    still = curve([0.0, 1.0], [2.0, 2.0])
    assert error(curve([0.0, 1.0], [2.5, 2.5]), still, least=5.0) == pytest.approx(0.1)


def test_angles_are_equal_where_they_differ_by_turns() -> None:
    one = curve([0.0, 1.0], [0.0, 1.0])
    turned = curve([0.0, 1.0], [2.0 * math.pi, 1.0 - 2.0 * math.pi])
    assert error(turned, one, angle=True) == pytest.approx(0.0, abs=1e-12)
    assert error(turned, one) > 1.0


# -- numbers, proposals, candidates


def test_the_envelope_bounds_the_vibration() -> None:
    assert residual_envelope(4.0, 1.0) == 0.5
    assert residual_envelope(1.0, 1.0) == 1.0
    assert residual_envelope(2.0, 1.0) == 1.0
    assert residual_envelope(3.0, 0.0) == 1.0
    taus = np.linspace(1.0, 9.0, 400)
    assert max(residual_vibration(4.0, tau) for tau in taus) <= residual_envelope(4.0, 1.0)


def test_the_first_frequency_is_that_of_a_cantilever() -> None:
    """1.875^2/(2 pi) sqrt(EI/(rho A L^4)) for a round body without a mass at its tip."""
    rod = tca.read("drop").member("rod")
    E, radius, rho, length = (rod.real(f"body.{key}") for key in ("E", "radius", "rho", "length"))
    wanted = 1.8751040687**2 / (2.0 * math.pi) * math.sqrt(E * radius**2 / (4.0 * rho)) / length**2
    assert dimensionless_numbers(tca.read("drop")).frequency == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize(
    ("load", "tolerance", "order"), [(1.0, 1e-3, 2), (1.0, 1e-2, 1), (10.0, 1e-3, 3), (1.0, 1.0, 0)]
)
def test_each_order_gains_a_decade(load: float, tolerance: float, order: int) -> None:
    hierarchies = (ModelHierarchy("order", "space", None, ({},) * 12),)
    numbers = DimensionlessNumbers(gravity=0.4 * load, tip=0.6 * load, parallel=False)
    assert propose_choice(hierarchies, numbers, tolerance) == {"order": order}


def test_candidates_go_from_coarse_to_fine() -> None:
    """All models of the rod; time steps only where it has inertia; in the end the coarsest heat with "
    "the rods chosen."""
    hierarchies = (
        ModelHierarchy("heat", "", None, ({},) * 4),
        ModelHierarchy("inertia", "", None, ({},) * 2),
        ModelHierarchy("order", "", None, ({},) * 2),
        ModelHierarchy("step", "", None, ({},) * 9),
        ModelHierarchy("macro", "", None, ({},) * 3),
    )
    chosen = [
        {"heat": 1, "inertia": 0, "order": 1, "step": 2, "macro": 2},
        {"heat": 2, "inertia": 1, "order": 0, "step": 6, "macro": 1},
    ]
    listed = list(candidates(hierarchies, chosen))
    assert listed[:2] == [{"heat": 2, "inertia": 0, "order": order, "step": 6, "macro": 1} for order in (0, 1)]
    moving = [each for each in listed[2:-2] if each["inertia"] == 1]
    assert moving == listed[2:-2]
    assert [each["step"] for each in moving[: len(moving) // 2]] == list(range(len(moving) // 2))
    assert max(each["step"] for each in moving) >= 6
    assert listed[-2:] == [{**each, "heat": 0} for each in chosen]


def test_kept_choices_are_those_of_this_code() -> None:
    version, digest = _code()
    assert version == tca.__version__
    assert len(digest) == 64
