"""Looking at results: the drawn body against closed forms and against the rod's own outputs, the field against the heat
model's, the page in a real browser, moving pictures."""

from __future__ import annotations

import io
import json
import re
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tca_cosim as tca
import xarray as xr
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright
from tca_cosim.cli import app
from tca_cosim.visualization import animation
from tca_cosim.visualization.charts import Chart, charts
from tca_cosim.visualization.geometry import disc, frames, tube
from tca_cosim.visualization.manipulator import STATIONS, manipulator, select_rows
from tca_cosim.visualization.report import page
from tca_cosim.visualization.report.field import Field, field
from typer.testing import CliRunner

FLAGS = [  # a browser without a graphics card that asks for nothing from outside
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.fixture(scope="module")
def result() -> xr.Dataset:
    return tca.run(tca.read("step", ["stop_time=12", "coupling.macro_step=0.25"]))


@pytest.fixture(scope="module")
def seen(result: xr.Dataset) -> Field:
    return field(result, "thermal", np.arange(49))


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


def test_chosen_rows_are_even_in_time_whatever_the_steps() -> None:
    times = np.concatenate([np.linspace(0.0, 1.0, 1000), np.arange(2.0, 11.0)])
    chosen = times[select_rows(xr.Dataset(coords={"time": times}), 11)]
    np.testing.assert_allclose(chosen, np.arange(11.0), atol=1e-3)
    assert select_rows(xr.Dataset(coords={"time": times[:4]}), 11).tolist() == [0, 1, 2, 3]


def test_the_field_agrees_with_the_heat_model(result: xr.Dataset, seen: Field) -> None:
    assert seen.gap < 0.03
    hottest = [seen.at(row).max() for row in range(49)]  # on a raster, which misses the hottest point
    np.testing.assert_allclose(hottest, result["thermal.T_max"], atol=0.3)
    assert seen.extremes == pytest.approx([298.15, float(result["thermal.T_max"].max())], abs=0.15)
    i, j = (np.abs(seen.axis - place).argmin() for place in seen.section.centres[2] + [0.0, 0.5e-3])
    assert seen.at(-1)[j, i] == pytest.approx(float(result["thermal.T"][-1, 2]), abs=5.0)  # in the hot ring


@pytest.mark.parametrize("scene", ["jump", "feedback"])
def test_the_field_follows_jumps_and_feedback(scene: str) -> None:
    computed = tca.run(tca.read(scene, ["stop_time=8"]))
    assert field(computed, "thermal", select_rows(computed, 41)).gap < 0.05


def test_the_field_needs_no_signals(result: xr.Dataset) -> None:
    """Voltages that another FMU sends are taken from the result itself."""
    members = json.loads(result.attrs["members"])
    members["thermal"]["signals"] = {}
    sent = result.assign_attrs(members=json.dumps(members))
    assert field(sent, "thermal", np.arange(49)).gap < 0.03


def test_charts_have_units_and_leave_out_what_is_nothing(result: xr.Dataset) -> None:
    shown = {chart.title: chart for chart in charts(result)}
    assert shown["Temperatures"].unit == "°C"
    assert shown["Position of the tip"].heading == "Position of the tip [mm]"
    assert "Gravity" not in shown
    assert [line.label for line in shown["Energies of the rod"].lines][:2] == ["elastic, body", "elastic, TCAs"]
    assert [line.label for line in shown["Position of the tip"].lines] == ["x", "y", "z"]
    z = shown["Position of the tip"].lines[2].values
    np.testing.assert_allclose(z, 1e3 * result["rod.tip.p"][:, 2])
    assert np.isnan(shown["Sweeps per macro step"].lines[0].values[0])  # no step ends at the start


def test_what_is_constant_is_text_instead_of_a_panel(result: xr.Dataset) -> None:
    voltages = next(chart for chart in charts(result) if chart.title == "Voltages")
    assert voltages.lines == ()
    assert voltages.constants_text == "TCA 1 = 0 V; TCA 2 = 1.5 V; TCA 3 = 3 V"
    figure = result.tca.plot()
    assert all(axes.lines for axes in figure.axes if axes.get_visible())
    assert "Voltages: TCA 1 = 0 V" in figure.get_supxlabel()


def test_quantities_are_plotted_by_name(result: xr.Dataset, tmp_path: Path) -> None:
    figure = result.tca.plot(["rod.tip.p", "thermal.T[3]", "rod.out_of_plane", "thermal.V"], tmp_path / "some.png")
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "Position of the tip [mm]",
        "Temperatures [°C]",
        "rod.out_of_plane",
        "Voltages [V]",
    ]
    assert [len(axes.lines) for axes in figure.axes] == [3, 1, 1, 3]
    np.testing.assert_allclose(figure.axes[1].lines[0].get_ydata(), result["thermal.T"][:, 2] - 273.15)
    assert (tmp_path / "some.png").stat().st_size > 10_000
    with pytest.raises(tca.CosimError, match=r"nearest names: rod\.tip\.p"):
        result.tca.plot(["rod.tip.pp"])
    with pytest.raises(tca.CosimError, match=r"rod\.tip\.p\[1\] to rod\.tip\.p\[3\]"):
        result.tca.plot(["rod.tip.p[4]"])
    with pytest.raises(tca.CosimError, match=r"\.png, \.svg, \.pdf"):
        result.tca.plot(["rod.tip.p"], tmp_path / "a.bmp")


def test_panels_of_a_figure_do_not_cover_each_other(result: xr.Dataset) -> None:
    """Legends stand above their panels, tick labels apart."""
    figure = result.tca.plot()
    figure.draw_without_rendering()
    for axes in (axes for axes in figure.axes if axes.get_visible()):
        legend = axes.get_legend()
        if legend:
            assert legend.get_window_extent().y0 >= axes.get_window_extent().y1 - 1.0
        boxes = [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]
        assert all(one.x1 < other.x0 for one, other in pairwise(boxes))


def test_members_of_other_models_get_charts_by_unit(result: xr.Dataset) -> None:
    foreign = result[["coupling.step"]].assign({"mine.y": ("time", np.ones(49), {"units": "N"})})
    foreign.attrs["members"] = json.dumps({"mine": {"fmu": "mine.fmu", "parameters": {}, "signals": {}}})
    first = charts(foreign)[0]
    assert (first.title, first.unit, first.constants_text) == ("mine", "N", "y = 1 N")
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


def opened(browser: Browser, path: Path, width: int = 1280, scheme: Any = "light") -> tuple[Page, list[str]]:
    """The page, and what goes wrong in it or is asked for from outside, as it comes."""
    wrong: list[str] = []
    view = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
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
    assert ((r > 180) & (g > 120) & (b < 90)).sum() > 300  # the hot TCA
    drawn = manipulator(result, np.arange(49))
    route = 1e3 * drawn.frames.sweep(drawn.route(2), np.arange(STATIONS))
    for row in (0, 20, 48):
        view.locator("#time").evaluate(
            "(slider, row) => { slider.value = row; slider.dispatchEvent(new Event('input')); }", row
        )
        view.wait_for_function(f"shown === {row}")
        places = view.evaluate(f"page.body.routes[2].map(([a, b], station) => body.shape.at({row}, station, a, b))")
        np.testing.assert_allclose(places, route[row], atol=5e-3)  # [mm], 16-bit numbers
        tcas = [view.evaluate(f"body.temperatures[{3 * row + i}]") for i in range(3)]
        np.testing.assert_allclose(tcas, result["thermal.T"][row] - 273.15, atol=3e-3)
        middle = view.evaluate("section.values[40 * section.data.points + 40]")
        assert middle == pytest.approx(seen.at(row)[40, 40] - 273.15, abs=0.05)
        x = 1e3 * float(result["rod.tip.p"][row, 0])
        assert float(text_of_legend(view, "Position of the tip [mm]").replace("−", "-")) == pytest.approx(x, rel=5e-3)
    cursor = view.evaluate("['x1', 'x2'].map((x) => Number(charts[0].svg.querySelector('.cursor').getAttribute(x)))")
    assert cursor == pytest.approx([view.evaluate("charts[0].right")] * 2)

    view.evaluate("performance.now = () => 0")
    view.locator("#play").click()  # from the end: starts again
    view.evaluate("performance.now = () => 5000")  # half of the time that playing takes
    view.wait_for_function("shown === 24")
    view.locator("#play").click()
    assert view.inner_text("#play").endswith("Play")
    assert view.inner_text("#clock") == "t = 6.00 s"
    box = view.locator("#chart-0 svg").bounding_box()
    assert box
    share = view.evaluate(
        "(charts[0].left + 0.75 * (charts[0].right - charts[0].left)) / charts[0].svg.viewBox.baseVal.width"
    )
    view.locator("#chart-0 svg").click(position={"x": share * box["width"], "y": 0.5 * box["height"]})
    assert view.inner_text("#clock") == "t = 9.00 s"
    assert wrong == []
    view.close()


def text_of_legend(view: Page, heading: str) -> str:
    """Value of a chart's first line, without its unit."""
    return view.locator("figure", has_text=heading).locator(".legend b").first.inner_text().split()[0]


def test_the_view_turns_by_keys_and_pointer(result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "view.html").write_text(result.tca.show().page, encoding="utf-8")
    view, wrong = opened(browser, tmp_path / "view.html")
    before = view.evaluate("[body.azimuth, body.elevation, body.zoom]")
    view.locator("#body").focus()
    for key in ("ArrowRight", "ArrowUp", "+"):
        view.keyboard.press(key)
    after = view.evaluate("[body.azimuth, body.elevation, body.zoom]")
    assert np.subtract(after, before) == pytest.approx([0.1, 0.1, 0.15])
    view.keyboard.press("0")
    assert view.evaluate("[body.azimuth, body.elevation, body.zoom]") == before
    view.locator("#body").hover()
    view.mouse.down()
    view.mouse.move(500, 300, steps=3)
    view.mouse.up()
    assert view.evaluate("body.azimuth") != before[0]
    picture = colours(view.locator("#body").screenshot())
    assert len(np.unique(picture, axis=0)) > 30
    assert wrong == []
    view.close()


@pytest.mark.parametrize(("width", "scheme"), [(1440, "light"), (768, "dark"), (390, "light"), (390, "dark")])
def test_pages_fit_screens(width: int, scheme: str, result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    """Nothing wider than the screen, text that contrasts with what it stands on, no view cut off."""
    page.write(result, tmp_path / "step.html")
    view, wrong = opened(browser, tmp_path / "step.html", width, scheme)
    assert view.evaluate("document.documentElement.scrollWidth") <= width
    assert view.evaluate("document.documentElement.scrollHeight") < 7000
    box = view.locator("#body").bounding_box()
    assert box
    assert 250 < box["height"] < 600
    assert box["x"] + box["width"] <= width
    inside = view.evaluate(
        "page.times.flatMap((_, row) => [0, 30].map((s) => body.project(body.shape.at(row, s))))"
        ".every(([x, y]) => x > 0 && y > 0 && x < body.canvas.clientWidth && y < body.canvas.clientHeight)"
    )
    assert inside
    for selector in ("body", ".soft", ".legend li", "th"):
        assert view.evaluate(CONTRAST, selector) >= 4.5, selector
    assert wrong == []
    view.close()


CONTRAST = """(selector) => {
  const luminance = (text) => {
    const [r, g, b] = text.match(/[\\d.]+/g).map(Number).map((c) => c / 255)
      .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  let behind = document.querySelector(selector);
  const ink = luminance(getComputedStyle(behind).color);
  while (getComputedStyle(behind).backgroundColor === "rgba(0, 0, 0, 0)") behind = behind.parentElement;
  const paper = luminance(getComputedStyle(behind).backgroundColor);
  return (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05);
}"""


def test_what_a_screen_reader_needs_is_there(result: xr.Dataset, tmp_path: Path) -> None:
    """Names of pictures and controls, unique ids, headings without gaps."""
    text = page.html(result)
    assert '<html lang="en">' in text
    assert len(re.findall(r"<svg [^>]*role=\"img\" aria-label=\"[^\"]+over time", text)) == len(charts_drawn(result))
    assert all(
        "aria-label" in tag or "aria-hidden" in tag for tag in re.findall(r"<canvas id[^>]*>|<input[^>]*>", text)
    )
    ids = re.findall(r"\bid=[\"']([^\"']+)", text)
    assert len(ids) == len(set(ids))
    levels = [int(level) for level in re.findall(r"<h(\d)>", text)]
    assert levels[0] == 1
    assert max(after - before for before, after in pairwise(levels)) == 1


def charts_drawn(result: xr.Dataset) -> list[Chart]:
    return [chart for chart in charts(result) if chart.lines]


def test_two_results_are_compared(result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    pulled = tca.run(tca.read("step", ["stop_time=12", "coupling.macro_step=0.25", "rod.gravity=[9.81, 0, 0]"]))
    pulled.tca.report(tmp_path / "both.html", result)
    alone = page.html(pulled)
    view, wrong = opened(browser, tmp_path / "both.html")
    table = view.inner_text("table >> nth=0")
    largest = 1e3 * float(np.abs(pulled["rod.tip.p"] - result["rod.tip.p"]).max())
    row = next(line for line in table.splitlines() if line.startswith("rod.tip.p"))
    assert float(row.split()[1]) == pytest.approx(largest, rel=5e-3)
    with_other = (tmp_path / "both.html").read_text(encoding="utf-8")
    assert with_other.count("stroke-dasharray") > alone.count("stroke-dasharray") + 20
    places = view.evaluate("body.other.at(48, 30)")
    np.testing.assert_allclose(places, 1e3 * result["rod.shape.p"][-1, -1], atol=5e-3)
    assert view.evaluate("page.body.gravity") == [[9.81, 0, 0]]
    assert wrong == []
    view.close()
    with pytest.raises(tca.CosimError, match="nothing to compare"):
        result.tca.report(tmp_path / "no.html", result.drop_vars(list(result.data_vars)))


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
    warned = [{"member": "rod", "text": "<planar> is set", "count": 3, "time": 0.5}]
    begun.attrs["warnings"] = json.dumps(warned)
    return {**alone, "begun": begun, "chosen": result.assign_attrs(fidelity=json.dumps(chosen), title=reason)}


@pytest.mark.parametrize("name", ["thermal", "rod", "begun", "chosen"])
def test_pages_show_what_there_is(name: str, result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    variant = variants(result)[name]
    page.write(variant, tmp_path / "it.html")
    view, wrong = opened(browser, tmp_path / "it.html")
    there = {part: view.locator(f"#{part}").count() > 0 for part in ("body", "section")}
    assert there == {"body": name != "thermal", "section": name != "rod"}
    text = view.inner_text("body")
    assert ("coupling failed <at once>" in text) == (name == "begun")
    assert ("rod: <planar> is set (at t = 0.5 s, 3 times in all)" in text) == (name == "begun")
    assert ("no gravity" in text and "escaped?" in text) == (name == "chosen")
    assert wrong == []
    view.close()


def test_a_page_is_one_small_file(result: xr.Dataset, tmp_path: Path) -> None:
    page.write(result, tmp_path / "new" / "step.html")
    assert [file.name for file in (tmp_path / "new").iterdir()] == ["step.html"]
    assert (tmp_path / "new" / "step.html").stat().st_size < 1.0e6


def test_pages_of_many_rows_stay_small(tmp_path: Path) -> None:
    """The largest of what an example gives: 3001 rows with fast changes."""
    page.write(tca.run("step", {"coupling.macro_step": 0.01}), tmp_path / "step.html")
    assert (tmp_path / "step.html").stat().st_size < 1.5e6


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
    animation.save(result, tmp_path / "step.webm", frames=6, fps=10.0)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "step.webm"))
    assert next(reader)["codec"] == "vp9"


@pytest.mark.parametrize("scene", ["step", "push"])
def test_a_gif_is_small_by_default(scene: str) -> None:
    assert len(tca.run(scene).tca.animate().data) < 1e6


def test_the_colours_of_a_gif_are_those_of_the_lines(result: xr.Dataset) -> None:
    """One palette for all frames has the colours of the lines and of temperatures in it."""
    with Image.open(io.BytesIO(result.tca.animate(frames=3).data)) as film:
        film.seek(2)
        seen = np.asarray(film.convert("RGB")).reshape(-1, 3).astype(int)
    for colour in ((0x00, 0x72, 0xB2), (0xD5, 0x5E, 0x00), (0x00, 0x9E, 0x73)):
        assert np.abs(seen - colour).max(axis=1).min() <= 12


def test_films_that_cannot_be_are_refused(result: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for path, count, fps, text in (
        ("a.avi", 5, 10.0, r"\.gif, \.mp4, \.webm"),
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
        (["animate", "--from", "step.nc", "--set", "rod.order=1"], "a result cannot be changed"),
        (["animate", "--from", "nowhere.nc"], "nowhere.nc"),
        (["report", "--from", "other.nc"], "not a result of a run"),
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
