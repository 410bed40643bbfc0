"""One description of the body for all who read it: values that set others, checks of sections, symmetry, drawings."""

from __future__ import annotations

import json
import math
import re
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim.scene.body import RodParameters
from tca_cosim.studies.model_selection.dimensionless_numbers import dimensionless_numbers
from tca_cosim.studies.model_selection.hierarchy import apply_choice, choice_settings, model_hierarchies
from tca_cosim.studies.model_selection.measure import requested_quantities
from tca_cosim.studies.model_selection.symmetry import symmetry_plane
from tca_cosim.visualization import animation
from tca_cosim.visualization.charts import charts
from tca_cosim.visualization.manipulator import STATIONS, Manipulator, manipulator, section_member

SHORT = {"stop_time": 4.0, "coupling.macro_step": 1.0}


def body(source: str, overrides: dict[str, Any] | None = None) -> RodParameters:
    rod = tca.read(source, overrides or {}).models("rod")[0]
    assert rod
    return RodParameters.of(rod)


def test_parameters_of_the_whole_body_reach_its_parts() -> None:
    two = {"body.segments": 2, "thermal.body.length": "60 mm", "tca.offset": "2 mm"}
    p = body("step", {**two, "rod.body.length": "60 mm", "rod.body.E": "1 MPa", "rod.segment.E[2]": "2 MPa"})
    assert [segment.length for segment in p.segments] == [0.03, 0.03]
    assert [segment.E for segment in p.segments] == [1e6, 2e6]
    assert {(one.offset, one.offset_end) for one in p.tcas} == {(2e-3, 2e-3)}
    wide = body("taper", {"body.radius": "6 mm"})  # set after the taper of the scene, it wins as in the FMU
    assert (wide.segments[0].radius, wide.segments[0].radius_end) == (6e-3, 6e-3)


def test_the_order_in_which_parameters_are_set_is_that_of_the_fmu() -> None:
    """What the description says is what moves: a scene with both equals one with the last of them alone."""
    both = tca.run("taper", {**SHORT, "rod.segment.radius[1,1]": "4 mm", "rod.segment.radius[1,2]": "3.5 mm"})
    record = json.loads(both.attrs["members"])["rod"]["parameters"]
    assert [record[f"segment.radius[1,{k}]"] for k in (1, 2)] == [4e-3, 3.5e-3]
    wide = tca.run("taper", {**SHORT, "rod.body.radius": "4 mm"})
    uniform = tca.run(
        "step",
        {**SHORT, "body.radius": "4 mm", "tca.offset": "2 mm", "thermal.V": [1, 2, 3], "rod.gravity": [-3, 0, 0]},
    )
    np.testing.assert_allclose(wide["rod.tip.p"], uniform["rod.tip.p"], atol=1e-7)
    assert abs(wide["rod.tip.p"] - both["rod.tip.p"]).max() > 1e-5


def test_choices_of_models_win_over_the_scene() -> None:
    scene = tca.read("step", {"rod.order": 2, "rod.strains": "bending"})
    rod = apply_choice(scene, {"order": 5, "strains": 3}).models("rod")[0]
    assert rod
    assert (rod.value("order"), rod.value("segment.order[1]")) == (5, 5)
    assert rod.value("segment.strains[1]") == rod.value("strains") == 4


@pytest.mark.parametrize(
    ("source", "overrides", "named"),
    [
        ("taper", {"thermal.body.radius": "6 mm"}, "thermal.body.radius = 0.006 m"),
        ("taper", {"thermal.tca.offset": "1 mm"}, "with 0.002 m; set thermal.tca.offset[1]"),
        ("serial", {"upper.body.length": "25 mm"}, "upper.body.length = 0.025 m, but TCA 4"),
        ("serial", {"lower.tca.azimuth[2]": "90 deg"}, "lower.tca.azimuth[2]"),
        ("serial", {"rod.segment.radius[2,1]": "3 mm", "rod.segment.radius[2,2]": "3 mm"}, "upper.body.radius"),
    ],
)
def test_sections_that_the_body_does_not_have_are_refused(source: str, overrides: dict[str, Any], named: str) -> None:
    if "upper.body.radius" in named:
        overrides = {**overrides, "tca.offset": "2 mm"}
    with pytest.raises(tca.SceneError, match=re.escape(named)):
        tca.read(source, overrides)


def test_planes_of_symmetry_compare_the_laws() -> None:
    """TCAs that mirror each other in place and heat but extend and contract bend across that plane, not in it."""
    across = {"tca.azimuth": ["90 deg", "270 deg"]}
    assert symmetry_plane(tca.read("antagonist", across)) == pytest.approx(math.pi / 2.0)
    assert symmetry_plane(tca.read("antagonist", {**across, "rod.tca.chirality": 1})) == 0.0
    held = {"rod.tca.ends": "tethered", "rod.closure": "inside"}
    assert symmetry_plane(tca.read("step", {"thermal.V": [3, 0, 0]})) == 0.0
    assert symmetry_plane(tca.read("step", {"thermal.V": [3, 0, 0], **held})) is None
    assert symmetry_plane(tca.read("serial")) == 0.0
    assert symmetry_plane(tca.read("serial", {"upper.V": [0, 1.5, 1.0]})) is None


def test_numbers_of_a_scene_see_the_whole_body() -> None:
    def numbers(source: str, overrides: dict[str, Any] | None = None) -> Any:
        return dimensionless_numbers(tca.read(source, overrides or {}))

    assert not numbers("taper").parallel  # the thin end bends most
    assert not numbers("serial").parallel
    plain, loaded = numbers("payload", {"rod.tip_body.mass": 0.0}), numbers("payload")
    ratio = 1.557298**2 / 3.516015**2  # first frequencies with a mass rho A L at the tip and without: Dunkerley's sum
    heavy = numbers("payload", {"rod.tip_body.mass": 1040.0 * math.pi * 25e-6 * 0.04})
    assert heavy.frequency / plain.frequency == pytest.approx(math.sqrt(ratio), rel=0.02)
    assert loaded.tip > plain.tip == 0.0


def test_levels_are_those_of_all_manipulators_and_sections() -> None:
    """A choice holds for every FMU of a model; plain settings of one section do not survive beside it."""
    serial = tca.read("serial", {"upper.level": "lumped"})
    settings = choice_settings(serial, {h.name: 1 for h in model_hierarchies(serial)})
    assert settings["lower.level"] == settings["upper.level"] == "reduced"
    gripper = tca.read("gripper")
    assert list(requested_quantities(gripper)) == ["left.tip.p", "right.tip.p"]
    settings = choice_settings(gripper, {h.name: 1 for h in model_hierarchies(gripper)})
    assert settings["left.order"] == settings["right.order"] == 1
    assert symmetry_plane(gripper) is None
    assert not dimensionless_numbers(gripper).arc  # the object pushes, by how much is not known
    assert dimensionless_numbers(tca.read("gripper", {"right.body.E": "10 kPa"})).frequency < 4.0  # of the softer one


def test_where_the_heat_transfer_varies_no_reduced_heat_is_chosen() -> None:
    fan = tca.read("fan", {"fidelity.level": "auto", "fidelity.tolerance": 1e-2, "stop_time": 20.0})
    heat = model_hierarchies(fan)[0]
    assert [level["level"] for level in heat.levels] == ["lumped", "full", "full", "full"]
    result = tca.run(fan)
    choice = json.loads(result.attrs["fidelity"])["choice"]
    assert choice["thermal.level"] == "full"
    fine = tca.run("fan", {"thermal.tolerance": 1e-4, "stop_time": 20.0})["rod.tip.p"].to_numpy()[-1]
    assert np.linalg.norm(result["rod.tip.p"].to_numpy()[-1] - fine) <= 1e-2 * np.linalg.norm(fine - [0.0, 0.0, 0.04])


def drawn(result: xr.Dataset) -> Manipulator:
    return manipulator(result, np.arange(result.sizes["time"]))


@pytest.fixture(scope="module")
def serial() -> xr.Dataset:
    return tca.run("serial", SHORT)


def test_tcas_are_drawn_along_their_spans(serial: xr.Dataset) -> None:
    m = drawn(serial)
    for i in range(6):
        first, behind = m.span(i)
        assert (m.stations[first], m.stations[behind - 1]) == pytest.approx((0.0, 0.02) if i < 3 else (0.02, 0.04))
        route = m.frames.sweep(m.route(i), np.arange(first, behind))
        chords = np.linalg.norm(np.diff(route, axis=1), axis=2).sum(axis=1)
        np.testing.assert_allclose(chords - 0.02, serial["rod.delta"][:, i], atol=2e-5)


def test_several_heat_models_are_shown_with_their_names(serial: xr.Dataset) -> None:
    titles = [chart.title for chart in charts(serial)]
    assert {"Temperatures, lower", "Temperatures, upper"} <= set(titles)
    assert section_member(serial) == "upper"
    thin = tca.run("serial", {**SHORT, "upper.tca.outer_radius": "0.6 mm"})
    assert drawn(thin).tca_radius == (0.85e-3,) * 3 + (0.6e-3,) * 3


def test_tapers_and_jumps_of_the_radius_are_drawn() -> None:
    taper = drawn(tca.run("taper", SHORT))
    np.testing.assert_allclose(taper.radii, np.linspace(5e-3, 3e-3, STATIONS))
    stepped = tca.run(
        "serial",
        {
            **SHORT,
            "rod.segment.radius[2,1]": "4 mm",
            "rod.segment.radius[2,2]": "4 mm",
            "upper.body.radius": "4 mm",
        },
    )
    m = drawn(stepped)
    at = np.flatnonzero(np.diff(m.stations) == 0.0)
    assert at.size == 1
    assert m.radii[at[0]] == 5e-3
    assert m.radii[at[0] + 1] == 4e-3
    np.testing.assert_allclose(m.frames.p[:, at[0]], m.frames.p[:, at[0] + 1], atol=1e-12)


def test_payloads_are_drawn_where_they_are() -> None:
    result = tca.run("payload", {"stop_time": 2.0, "rod.tip_body.centre": ["1 mm", "0 mm", "5 mm"]})
    m = drawn(result)
    assert m.payload
    assert m.payload.mass == 2e-3
    away = m.payload.centre - result["rod.tip.p"].to_numpy()
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), math.hypot(1e-3, 5e-3))
    np.testing.assert_allclose(away[0], [1e-3, 0.0, 5e-3], atol=1e-4)  # it hangs, a little tilted
    with_ball, _ = animation.images(result, 2, (320, 180))
    without, _ = animation.images(tca.run("payload", {"stop_time": 2.0, "rod.tip_body.mass": 0}), 2, (320, 180))
    assert np.abs(with_ball.astype(int) - without).max() > 100


@pytest.mark.parametrize(
    ("source", "overrides", "expected"),
    [
        ("step", {}, []),
        ("step", {"body.segments": 2}, []),
        ("step", {"body.segments": 2, "rod.segment.E[2]": "2 MPa"}, ["segments that differ"]),
        ("step", {"rod.segment.radius[1,2]": "4 mm"}, ["a radius that changes along the body"]),
        ("step", {"rod.tca.offset_end[1]": "2 mm"}, ["a distance of a TCA from the centreline that changes"]),
        ("step", {"rod.tca.pitch": "current"}, ["tca.pitch = 'current'"]),
        ("step", {"rod.tca.contact": "bonded"}, ["tca.contact = 'bonded'"]),
        ("step", {"rod.tca.ends": "tethered"}, ["tca.ends = 'tethered'"]),
        ("step", {"rod.tip_body.mass": "1 g"}, ["a body at the tip"]),
        ("step", {"rod.tca.law": "measured"}, []),
        ("step", {"rod.tca.law": "measured", "rod.tca.stiffening[2]": 5}, ["a measured law that is not linear"]),
        (
            "step",
            {"rod.tca.law": "measured", "rod.tca.stroke_curvature[1]": 1e-6},
            ["a measured law that is not linear"],
        ),
        ("step", {"rod.tca.law": "measured", "rod.tca.stop_stiffness[3]": 9}, ["a measured law that is not linear"]),
        ("step", {"rod.tca.stiffening": 5}, []),  # the law is that of the wire
    ],
)
def test_what_makes_a_body_another_than_a_uniform_one(source: str, overrides: dict, expected: list[str]) -> None:
    assert body(source, overrides).differences_from_uniform() == expected


def test_the_radius_of_a_body_is_its_largest() -> None:
    assert body("step", {"rod.segment.radius[1,2]": "4 mm"}).radius == 5e-3
    assert body("step", {"rod.segment.radius[1,2]": "6 mm"}).radius == 6e-3
