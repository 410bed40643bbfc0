"""Looking at results: the drawn body against closed forms and against the rod's own outputs, the field against the heat
model's, the page in a real browser, moving pictures."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright
from tca_cosim.cli import app
from tca_cosim.visualization import animation
from tca_cosim.visualization.charts import charts
from tca_cosim.visualization.geometry import disc, frames, tube
from tca_cosim.visualization.manipulator import STATIONS, manipulator, moments
from tca_cosim.visualization.report import page
from tca_cosim.visualization.report.field import Field, field
from typer.testing import CliRunner

FLAGS = [  # a browser that stays by itself, and draws WebGL without a graphics card
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]


@pytest.fixture(scope="module")
def result() -> xr.Dataset:
    return tca.run(tca.read("step", ["stop_time=12", "coupling.macro_step=0.25"]))


@pytest.fixture(scope="module")
def seen(result: xr.Dataset) -> Field:
    return field(result, "thermal", np.arange(49), STATIONS - 1)


def arc(curvature: float, length: float, stations: int) -> tuple[np.ndarray, np.ndarray]:
    """Centreline (stations, 3) of a rod bent in the plane of x and z, and its directions across it in that plane."""
    angle = curvature * np.linspace(0.0, length, stations)
    points = np.column_stack([1.0 - np.cos(angle), 0.0 * angle, np.sin(angle)]) / curvature
    return points, np.column_stack([np.cos(angle), 0.0 * angle, -np.sin(angle)])


def test_cross_sections_of_an_arc_are_those_of_constant_curvature() -> None:
    curvature, length = 35.0, 0.04
    points, across = arc(curvature, length, 21)
    half = 0.5 * curvature * length
    found = frames(points[None], np.array([[np.cos(half), 0.0, np.sin(half), 0.0]]), 41)
    exact, across = arc(curvature, length, 41)
    np.testing.assert_allclose(found.p[0], exact, atol=2e-8)
    np.testing.assert_allclose(found.d1[0], across, atol=1e-4)  # a spline's slope at its ends
    np.testing.assert_allclose(found.d2[0], np.tile([0.0, 1.0, 0.0], (41, 1)), atol=1e-12)
    inner = found.sweep(np.tile([2.5e-3, 0.0], (41, 1)), np.arange(41))[0]
    chords = np.linalg.norm(np.diff(inner, axis=0), axis=1).sum()
    assert chords == pytest.approx(length * (1.0 - curvature * 2.5e-3), rel=1e-4)  # chords: (angle of a step)^2/24


def test_twist_is_even_and_may_pass_half_a_turn() -> None:
    straight = np.tile(np.linspace([0.0, 0.0, 0.0], [0.0, 0.0, 0.04], 21), (8, 1, 1))
    turn = np.linspace(0.0, 5.0, 8)
    found = frames(straight, np.column_stack([np.cos(turn / 2), 0 * turn, 0 * turn, np.sin(turn / 2)]), 11)
    expected = turn[:, None] * np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(found.d1[..., 0], np.cos(expected), atol=1e-12)
    np.testing.assert_allclose(found.d1[..., 1], np.sin(expected), atol=1e-12)


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


def test_the_drawn_tcas_are_as_long_as_the_rod_says(result: xr.Dataset) -> None:
    drawn = manipulator(result, np.arange(49))
    for i in range(3):
        route = drawn.frames.sweep(drawn.route(i), np.arange(STATIONS))
        chords = np.linalg.norm(np.diff(route, axis=1), axis=2).sum(axis=1)
        np.testing.assert_allclose(chords - drawn.length, result["rod.delta"][:, i], atol=5e-6)


def test_helical_routings_are_drawn_as_long_as_the_rod_says() -> None:
    bent = tca.run("step", {"stop_time": 10, "coupling.macro_step": 1.0, "rod.tca.helix": [60, -40, 0]})
    drawn = manipulator(bent, np.arange(11))
    for i in range(3):
        route = drawn.frames.sweep(drawn.route(i), np.arange(STATIONS))
        chords = np.linalg.norm(np.diff(route, axis=1), axis=2).sum(axis=1)
        # The cross-sections are drawn normal to the centreline, twisted evenly: 1 % of the displacement.
        np.testing.assert_allclose(chords - chords[0], bent["rod.delta"][:, i], atol=5e-5)


def test_moments_are_even_in_time_whatever_the_steps() -> None:
    times = np.concatenate([np.linspace(0.0, 1.0, 1000), np.arange(2.0, 11.0)])
    chosen = times[moments(xr.Dataset(coords={"time": times}), 11)]
    np.testing.assert_allclose(chosen, np.arange(11.0), atol=1e-3)
    assert moments(xr.Dataset(coords={"time": times[:4]}), 11).tolist() == [0, 1, 2, 3]


def test_the_field_agrees_with_the_heat_model(result: xr.Dataset, seen: Field) -> None:
    assert seen.gap < 0.03
    hottest = seen.T_0 + (seen.cap_modes @ seen.courses.T).max(axis=0)
    np.testing.assert_allclose(hottest, result["thermal.T_max"], atol=0.15)
    i, j = (np.abs(seen.axis - place).argmin() for place in seen.section.centres[2] + [0.0, 0.5e-3])
    assert seen.at(-1)[j, i] == pytest.approx(float(result["thermal.T"][-1, 2]), abs=5.0)  # in the hot ring


@pytest.mark.parametrize("scene", ["jump", "feedback"])
def test_the_field_follows_jumps_and_feedback(scene: str) -> None:
    computed = tca.run(tca.read(scene, ["stop_time=8"]))
    assert field(computed, "thermal", moments(computed, 41), 0).gap < 0.05


def test_the_field_needs_no_signals(result: xr.Dataset) -> None:
    """Voltages that another FMU sends are taken from the result itself."""
    members = json.loads(result.attrs["members"])
    members["thermal"]["signals"] = {}
    sent = result.assign_attrs(members=json.dumps(members))
    assert field(sent, "thermal", np.arange(49), 0).gap < 0.03


def test_charts_have_units_and_leave_out_what_is_nothing(result: xr.Dataset) -> None:
    shown = {chart.title: chart for chart in charts(result)}
    assert shown["Temperatures"].unit == "°C"
    assert shown["Position of the tip"].unit == "mm"
    assert "Gravity" not in shown
    assert [line.label for line in shown["Energies of the rod"].lines][:2] == ["elastic, body", "elastic, TCAs"]
    z = shown["Position of the tip"].lines[2].values
    np.testing.assert_allclose(z, 1e3 * result["rod.tip.p"][:, 2])
    assert np.isnan(shown["Sweeps per macro step"].lines[0].values[0])  # nothing ended at the start


def test_members_of_other_models_get_charts_by_unit(result: xr.Dataset) -> None:
    foreign = result[["coupling.step"]].assign({"mine.y": ("time", np.ones(49), {"units": "N"})})
    foreign.attrs["members"] = json.dumps({"mine": {"fmu": "mine.fmu", "parameters": {}, "signals": {}}})
    first = charts(foreign)[0]
    assert (first.title, first.unit, first.lines[0].label) == ("mine", "N", "y")
    with pytest.raises(tca.CosimError, match="no shape to draw"):
        manipulator(foreign, np.arange(49))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert found, "no Chromium; on Debian: apt-get install chromium"
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=found, args=FLAGS)
        yield browser
        browser.close()


def opened(browser: Browser, path: Path) -> tuple[Page, list[str]]:
    """The page, and what goes wrong in it or is asked for from outside, as it comes."""
    wrong: list[str] = []
    view = browser.new_page(viewport={"width": 1280, "height": 900})
    view.set_default_timeout(120_000)  # [ms], for busy machines
    view.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    view.on("pageerror", lambda error: wrong.append(str(error)))
    view.on("request", lambda request: wrong.append(request.url) if request.url.startswith("http") else None)
    view.goto(path.as_uri())
    view.wait_for_function("typeof shown === 'number' && shown >= 0")
    return view, wrong


def colours(picture: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).reshape(-1, 3).astype(int)


def test_the_page_in_a_browser(result: xr.Dataset, seen: Field, browser: Browser, tmp_path: Path) -> None:
    page.write(result, tmp_path / "step.html")
    view, wrong = opened(browser, tmp_path / "step.html")
    assert view.title() == result.attrs["title"]
    assert view.inner_text("#clock") == "t = 12.00 s"
    r, g, b = colours(view.locator("#body").screenshot()).T
    assert ((r > 180) & (g > 120) & (b < 90)).sum() > 300  # the hot TCA, drawn by WebGL

    drawn = manipulator(result, np.arange(49))
    expected = 1e3 * drawn.frames.sweep(drawn.body.offsets, drawn.body.stations)
    for row in (0, 20, 48):
        view.locator("#time").evaluate(
            "(slider, row) => { slider.value = row; slider.dispatchEvent(new Event('input')); }", row
        )
        view.wait_for_function(f"shown === {row}")
        places = [view.evaluate(f"Array.from(body.place.data[4].{axis})") for axis in "xyz"]
        np.testing.assert_allclose(np.array(places).T, expected[row], atol=1e-3)
        tcas = [view.evaluate(f"body.place.data[{1 + i}].intensity[0]") for i in range(3)]
        np.testing.assert_allclose(tcas, result["thermal.T"][row] - 273.15, atol=1e-3)
        middle = view.evaluate("field.place.data[0].z[50][50]")
        assert middle == pytest.approx(seen.at(row)[50, 50] - 273.15, abs=0.05)
    view.locator("#chart-0").scroll_into_view_if_needed()
    view.wait_for_function("charts[0].layout.shapes[0].x0 === 12")

    view.evaluate("performance.now = () => 0")
    view.locator("#play").click()  # from the end: starts again
    view.evaluate("performance.now = () => 5000")  # half of the film
    view.wait_for_function("shown === 24")
    view.locator("#play").click()
    assert view.inner_text("#play").endswith("Play")
    assert view.inner_text("#clock") == "t = 6.00 s"

    view.set_viewport_size({"width": 700, "height": 900})  # one column then; nothing collapses
    view.wait_for_function("charts[0]._fullLayout.width > 600")
    heights = view.evaluate("[body.place, field.place, ...charts].map((p) => p._fullLayout.height)")
    assert min(heights) > 250
    assert wrong == []
    view.close()


def variants(result: xr.Dataset) -> dict[str, xr.Dataset]:
    """Results that lack something, or hold what a page must not stumble over."""
    members = json.loads(result.attrs["members"])
    alone = {
        name: result[[v for v in result.data_vars if str(v).startswith(f"{name}.")]].assign_attrs(
            members=json.dumps({name: members[name]})
        )
        for name in members
    }
    reason = "</script><script>throw new Error('escaped?')</script>"
    chosen = {"choice": {"rod.order": 0}, "reasons": [reason, "no gravity"], "budget": {"tip.p": "0.1 mm"}}
    begun = result.isel(time=slice(0, 1)).assign_attrs(status="partial: coupling failed <at once>")
    return {**alone, "begun": begun, "chosen": result.assign_attrs(fidelity=json.dumps(chosen), title=reason)}


@pytest.mark.parametrize("name", ["thermal", "rod", "begun", "chosen"])
def test_pages_show_what_there_is(name: str, result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    variant = variants(result)[name]
    page.write(variant, tmp_path / "it.html")
    view, wrong = opened(browser, tmp_path / "it.html")
    there = {place: view.locator(f"#{place} .main-svg").count() > 0 for place in ("body", "section")}
    assert there == {"body": name != "thermal", "section": name != "rod"}
    text = view.inner_text("body")
    assert ("coupling failed <at once>" in text) == (name == "begun")
    assert ("no gravity" in text and "escaped?" in text) == (name == "chosen")
    assert wrong == []
    view.close()


def test_a_page_without_graphics_card_or_browser_is_one_file(result: xr.Dataset, tmp_path: Path) -> None:
    page.write(result, tmp_path / "new" / "step.html")
    assert [file.name for file in (tmp_path / "new").iterdir()] == ["step.html"]
    assert (tmp_path / "new" / "step.html").stat().st_size < 8e6


def test_a_gif_moves(result: xr.Dataset, tmp_path: Path) -> None:
    steps: list[None] = []
    animation.save(result, tmp_path / "step.gif", frames=5, fps=10.0, progress=lambda: steps.append(None))
    with Image.open(tmp_path / "step.gif") as film:
        assert (film.n_frames, film.info["duration"], film.info["loop"], len(steps)) == (5, 100, 0, 5)
        pictures = []
        for k in range(5):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB")).astype(int))
    half = pictures[0].shape[1] // 2
    for one, other in pairwise(pictures):
        changed = np.abs(one - other).max(axis=2) > 30
        assert changed[:, :half].sum() > 200  # the body
        assert changed[:, half:].sum() > 200  # the line in the charts


def test_an_mp4_has_its_frames(result: xr.Dataset, tmp_path: Path) -> None:
    import imageio_ffmpeg

    animation.save(result, tmp_path / "step.mp4", frames=6, fps=10.0)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "step.mp4"))
    assert next(reader)["size"] == (960, 540)
    assert len(list(reader)) == 6


def test_films_that_cannot_be_are_refused(result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for path, count, fps, text in (
        ("a.avi", 5, 10.0, r"\.gif, \.mp4"),
        ("a.gif", 1, 10.0, "2 or more"),
        ("a.gif", 5, 0.0, "fps"),
    ):
        with pytest.raises(tca.CosimError, match=text):
            animation.save(result, tmp_path / path, count, fps)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(tca.CosimError, match=r"tca-cosim\[report\]"):
        animation.save(result, tmp_path / "a.mp4", 2)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["report"], "not both"),
        (["report", "step", "--from", "step.nc"], "not both"),
        (["animate", "--from", "step.nc", "--set", "rod.order=1"], "a result is as it is"),
        (["animate", "--from", "nowhere.nc"], "nowhere.nc"),
        (["report", "--from", "other.nc"], "no result of a run"),
    ],
)
def test_commands_that_have_nothing_to_show(
    arguments: list[str], text: str, result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    tca.write(result, tmp_path / "step.nc")
    xr.Dataset({"a": 1.0}).to_netcdf(tmp_path / "other.nc")
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2
    assert text in " ".join(done.stderr.split())
    assert not (tmp_path / "results").exists()


def test_a_run_that_fails_is_shown_as_far_as_it_came(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["report", "plain", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "diverges" in done.stderr
    assert "ended early" in (tmp_path / "plain.partial.html").read_text(encoding="utf-8")
