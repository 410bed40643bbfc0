"""The report's geometry, heat field and charts."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from tca_cosim.visualization.charts import charts
from tca_cosim.visualization.geometry import disc, frames, tube
from tca_cosim.visualization.manipulator import STATIONS, manipulator, select_rows
from tca_cosim.visualization.report.field import Field, field


def arc(curvature: float, length: float, stations: int) -> tuple[np.ndarray, np.ndarray]:
    """Centreline (stations, 3) of a rod bent in the plane of x and z, and its directions across it in that plane."""
    angle = curvature * np.linspace(0.0, length, stations)
    points = np.column_stack([1.0 - np.cos(angle), 0.0 * angle, np.sin(angle)]) / curvature
    return points, np.column_stack([np.cos(angle), 0.0 * angle, -np.sin(angle)])


def test_cross_sections_of_an_arc_are_those_of_constant_curvature() -> None:
    curvature, length = 35.0, 0.04
    points, across = arc(curvature, length, 21)
    half = 0.5 * curvature * length
    actual = frames(points[None], np.array([[np.cos(half), 0.0, np.sin(half), 0.0]]), 41)
    exact, across = arc(curvature, length, 41)
    np.testing.assert_allclose(actual.p[0], exact, atol=2e-8)
    np.testing.assert_allclose(actual.d1[0], across, atol=1e-4)  # a spline's slope at its ends
    np.testing.assert_allclose(actual.d2[0], np.tile([0.0, 1.0, 0.0], (41, 1)), atol=1e-12)
    inner = actual.sweep(np.tile([2.5e-3, 0.0], (41, 1)), np.arange(41))[0]
    chords = np.linalg.norm(np.diff(inner, axis=0), axis=1).sum()
    assert chords == pytest.approx(length * (1.0 - curvature * 2.5e-3), rel=1e-4)  # chords: (angle of a step)^2/24


def test_twist_is_even_and_may_pass_half_a_turn() -> None:
    straight = np.tile(np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 0.04], 21), (8, 1, 1))
    turn = np.linspace(0.0, 5.0, 8)
    actual = frames(straight, np.column_stack([np.cos(turn / 2), 0 * turn, 0 * turn, np.sin(turn / 2)]), 11)
    expected = turn[:, None] * np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(actual.d1[..., 0], np.cos(expected), atol=1e-12)
    np.testing.assert_allclose(actual.d1[..., 1], np.sin(expected), atol=1e-12)


def test_surfaces_close_and_have_their_area() -> None:
    straight = frames(np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 0.04], 21)[None], np.array([[1.0, 0.0, 0.0, 0.0]]), 9)
    for surface, area in (
        (tube(np.zeros((9, 2)), 5e-3, 48), 2 * np.pi * 5e-3 * 0.04),
        (disc(5e-3, 8, 48), np.pi * 25e-6),
    ):
        corners = straight.sweep(surface.offsets, surface.stations)[0][surface.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert 0.5 * np.linalg.norm(normals, axis=1).sum() == pytest.approx(area, rel=4e-3)
    outward = (normals[:, 2] > 0.0).all()
    assert outward


def test_the_drawn_tcas_are_as_long_as_the_rod_says(step_result: xr.Dataset) -> None:
    drawn = manipulator(step_result, np.arange(49))
    for i in range(3):
        route = drawn.frames.sweep(drawn.route(i), np.arange(STATIONS))
        chords = np.linalg.norm(np.diff(route, axis=1), axis=2).sum(axis=1)
        np.testing.assert_allclose(chords - drawn.length, step_result["rod.delta"][:, i], atol=5e-6)


def test_helical_routings_are_drawn_as_long_as_the_rod_says() -> None:
    bent = tca.run("step", {"stop_time": 10, "coupling.macro_step": 1.0, "rod.tca.helix": [60, -40, 0]})
    drawn = manipulator(bent, np.arange(11))
    for i in range(3):
        route = drawn.frames.sweep(drawn.route(i), np.arange(STATIONS))
        chords = np.linalg.norm(np.diff(route, axis=1), axis=2).sum(axis=1)
        # The cross-sections are drawn normal to the centreline, twisted evenly: 1 % of the displacement.
        np.testing.assert_allclose(chords - chords[0], bent["rod.delta"][:, i], atol=5e-5)


def test_chosen_rows_are_even_in_time_whatever_the_steps() -> None:
    times = np.concatenate([np.linspace(0.0, 1.0, 1000), np.arange(2.0, 11.0)])
    chosen = times[select_rows(xr.Dataset(coords={"time": times}), 11)]
    np.testing.assert_allclose(chosen, np.arange(11.0), atol=1e-3)
    assert select_rows(xr.Dataset(coords={"time": times[:4]}), 11).tolist() == [0, 1, 2, 3]


def test_the_field_agrees_with_the_heat_model(step_result: xr.Dataset, step_field: Field) -> None:
    assert step_field.gap < 0.03
    hottest = [step_field.at(row).max() for row in range(49)]  # on a raster, which misses the hottest point
    np.testing.assert_allclose(hottest, step_result["thermal.T_max"], atol=0.3)
    assert step_field.extremes == pytest.approx([298.15, float(step_result["thermal.T_max"].max())], abs=0.15)
    i, j = (
        np.abs(step_field.axis - coordinate).argmin() for coordinate in step_field.section.centres[2] + [0.0, 0.5e-3]
    )
    assert step_field.at(-1)[j, i] == pytest.approx(float(step_result["thermal.T"][-1, 2]), abs=5.0)  # in the hot ring


@pytest.mark.parametrize("scene", ["jump", "feedback"])
def test_the_field_follows_jumps_and_feedback(scene: str) -> None:
    computed = tca.run(tca.read(scene, ["stop_time=8"]))
    assert field(computed, "thermal", select_rows(computed, 41)).gap < 0.05


def test_the_field_needs_no_signals(step_result: xr.Dataset) -> None:
    """Voltages that another FMU sends are taken from the result itself."""
    members = json.loads(step_result.attrs["members"])
    members["thermal"]["signals"] = {}
    sent = step_result.assign_attrs(members=json.dumps(members))
    assert field(sent, "thermal", np.arange(49)).gap < 0.03


def test_charts_have_units_and_leave_out_what_is_nothing(step_result: xr.Dataset) -> None:
    shown = {chart.title: chart for chart in charts(step_result)}
    assert shown["Temperatures"].unit == "°C"
    assert shown["Position of the tip"].heading == "Position of the tip [mm]"
    assert "Gravity" not in shown
    assert [line.label for line in shown["Energies of the rod"].lines][:2] == ["elastic, body", "elastic, TCAs"]
    assert [line.label for line in shown["Position of the tip"].lines] == ["x", "y", "z"]
    z = shown["Position of the tip"].lines[2].values
    np.testing.assert_allclose(z, 1e3 * step_result["rod.tip.p"][:, 2])
    assert np.isnan(shown["Sweeps per macro step"].lines[0].values[0])  # no step ends at the start


def test_what_is_constant_is_text_instead_of_a_panel(step_result: xr.Dataset) -> None:
    voltages = next(chart for chart in charts(step_result) if chart.title == "Voltages")
    assert voltages.lines == ()
    assert voltages.constants_text == "TCA 1 = 0 V; TCA 2 = 1.5 V; TCA 3 = 3 V"
    figure = step_result.tca.plot()
    assert all(axes.lines for axes in figure.axes if axes.get_visible())
    assert "Voltages: TCA 1 = 0 V" in figure.get_supxlabel()


def test_quantities_are_plotted_by_name(step_result: xr.Dataset, tmp_path: Path) -> None:
    figure = step_result.tca.plot(["rod.tip.p", "thermal.T[3]", "rod.out_of_plane", "thermal.V"], tmp_path / "some.png")
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "Position of the tip [mm]",
        "Temperatures [°C]",
        "rod.out_of_plane",
        "Voltages [V]",
    ]
    assert [len(axes.lines) for axes in figure.axes] == [3, 1, 1, 3]
    np.testing.assert_allclose(figure.axes[1].lines[0].get_ydata(), step_result["thermal.T"][:, 2] - 273.15)
    assert (tmp_path / "some.png").stat().st_size > 10_000
    with pytest.raises(tca.CosimError, match=r"nearest names: rod\.tip\.p"):
        step_result.tca.plot(["rod.tip.pp"])
    with pytest.raises(tca.CosimError, match=r"rod\.tip\.p\[1\] to rod\.tip\.p\[3\]"):
        step_result.tca.plot(["rod.tip.p[4]"])
    with pytest.raises(tca.CosimError, match=r"\.png, \.svg, \.pdf"):
        step_result.tca.plot(["rod.tip.p"], tmp_path / "a.bmp")


def test_panels_of_a_figure_do_not_cover_each_other(step_result: xr.Dataset) -> None:
    """Legends stand above their panels, tick labels apart."""
    figure = step_result.tca.plot()
    figure.draw_without_rendering()
    for axes in (axes for axes in figure.axes if axes.get_visible()):
        legend = axes.get_legend()
        if legend:
            assert legend.get_window_extent().y0 >= axes.get_window_extent().y1 - 1.0
        boxes = [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]
        assert all(one.x1 < other.x0 for one, other in pairwise(boxes))


def test_members_of_other_models_get_charts_by_unit(step_result: xr.Dataset) -> None:
    foreign = step_result[["coupling.step"]].assign({"mine.y": ("time", np.ones(49), {"units": "N"})})
    foreign.attrs["members"] = json.dumps({"mine": {"fmu": "mine.fmu", "parameters": {}, "signals": {}}})
    first = charts(foreign)[0]
    assert (first.title, first.unit, first.constants_text) == ("mine", "N", "y = 1 N")
    with pytest.raises(tca.CosimError, match="no shape to draw"):
        manipulator(foreign, np.arange(49))
