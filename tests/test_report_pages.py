"""The report's pages in a browser: interaction, widths, contrast, what is shown of partial results, size."""

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
from tca_cosim.visualization.charts import Chart, charts
from tca_cosim.visualization.manipulator import STATIONS, manipulator
from tca_cosim.visualization.report import page
from tca_cosim.visualization.report.field import Field

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
def browser() -> Iterator[Browser]:
    actual = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert actual, "no Chromium; on Debian: apt-get install chromium"
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=actual, args=FLAGS)
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


def test_the_page_in_a_browser(step_result: xr.Dataset, step_field: Field, browser: Browser, tmp_path: Path) -> None:
    page.write(step_result, tmp_path / "step.html")
    view, wrong = opened(browser, tmp_path / "step.html")
    assert view.title() == step_result.attrs["title"]
    assert view.inner_text("#clock") == "t = 12.00 s"
    r, g, b = colours(view.locator("#body").screenshot()).T
    assert ((r > 180) & (g > 120) & (b < 90)).sum() > 300  # the hot TCA
    drawn = manipulator(step_result, np.arange(49))
    route = 1e3 * drawn.frames.sweep(drawn.route(2), np.arange(STATIONS))
    for row in (0, 20, 48):
        view.locator("#time").evaluate(
            "(slider, row) => { slider.value = row; slider.dispatchEvent(new Event('input')); }", row
        )
        view.wait_for_function(f"shown === {row}")
        places = view.evaluate(
            "page.body.manipulators[0].routes[2].points.map(([a, b], station) => "
            f"body.bodies[0].shape.at({row}, station, a, b))"
        )
        np.testing.assert_allclose(places, route[row], atol=5e-3)  # [mm], 16-bit numbers
        tcas = [view.evaluate(f"body.bodies[0].temperatures[{3 * row + i}]") for i in range(3)]
        np.testing.assert_allclose(tcas, step_result["thermal.T"][row] - 273.15, atol=3e-3)
        middle = view.evaluate("section.values[40 * section.data.points + 40]")
        assert middle == pytest.approx(step_field.at(row)[40, 40] - 273.15, abs=0.05)
        x = 1e3 * float(step_result["rod.tip.p"][row, 0])
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


def test_the_view_turns_by_keys_and_pointer(step_result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    (tmp_path / "view.html").write_text(step_result.tca.show().page, encoding="utf-8")
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
def test_pages_fit_screens(width: int, scheme: str, step_result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    """Nothing wider than the screen, text that contrasts with what it stands on, no view cut off."""
    page.write(step_result, tmp_path / "step.html")
    view, wrong = opened(browser, tmp_path / "step.html", width, scheme)
    assert view.evaluate("document.documentElement.scrollWidth") <= width
    assert view.evaluate("document.documentElement.scrollHeight") < 7000
    box = view.locator("#body").bounding_box()
    assert box
    assert 250 < box["height"] < 600
    assert box["x"] + box["width"] <= width
    inside = view.evaluate(
        "page.times.flatMap((_, row) => [0, 30].map((s) => body.project(body.bodies[0].shape.at(row, s))))"
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


def test_what_a_screen_reader_needs_is_there(step_result: xr.Dataset, tmp_path: Path) -> None:
    """Names of pictures and controls, unique ids, headings without gaps."""
    text = page.html(step_result)
    assert '<html lang="en">' in text
    assert len(re.findall(r"<svg [^>]*role=\"img\" aria-label=\"[^\"]+over time", text)) == len(
        charts_drawn(step_result)
    )
    assert all(
        "aria-label" in tag or "aria-hidden" in tag for tag in re.findall(r"<canvas id[^>]*>|<input[^>]*>", text)
    )
    ids = re.findall(r"\bid=[\"']([^\"']+)", text)
    assert len(ids) == len(set(ids))
    levels = [int(level) for level in re.findall(r"<h(\d)>", text)]
    assert levels[0] == 1
    assert max(after - before for before, after in pairwise(levels)) == 1


def charts_drawn(step_result: xr.Dataset) -> list[Chart]:
    return [chart for chart in charts(step_result) if chart.lines]


def test_two_results_are_compared(step_result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    pulled = tca.run(tca.read("step", ["stop_time=12", "coupling.macro_step=0.25", "rod.gravity=[9.81, 0, 0]"]))
    pulled.tca.report(tmp_path / "both.html", step_result)
    alone = page.html(pulled)
    view, wrong = opened(browser, tmp_path / "both.html")
    table = view.inner_text("table >> nth=0")
    largest = 1e3 * float(np.abs(pulled["rod.tip.p"] - step_result["rod.tip.p"]).max())
    row = next(line for line in table.splitlines() if line.startswith("rod.tip.p"))
    assert float(row.split()[1]) == pytest.approx(largest, rel=5e-3)
    with_other = (tmp_path / "both.html").read_text(encoding="utf-8")
    assert with_other.count("stroke-dasharray") > alone.count("stroke-dasharray") + 20
    places = view.evaluate("body.others[0].at(48, 30)")
    np.testing.assert_allclose(places, 1e3 * step_result["rod.shape.p"][-1, -1], atol=5e-3)
    assert view.evaluate("page.body.gravity") == [[9.81, 0, 0]]
    assert wrong == []
    view.close()
    with pytest.raises(tca.CosimError, match="nothing to compare"):
        step_result.tca.report(tmp_path / "no.html", step_result.drop_vars(list(step_result.data_vars)))


def variants(step_result: xr.Dataset) -> dict[str, xr.Dataset]:
    """Results that lack something, or hold what a page must not stumble over."""
    members = json.loads(step_result.attrs["members"])
    alone = {
        name: step_result[[v for v in step_result.data_vars if str(v).startswith(f"{name}.")]].assign_attrs(
            members=json.dumps({name: members[name]})
        )
        for name in members
    }
    reason = "</script><script>throw new Error('escaped?')</script>"
    chosen = {"choice": {"rod.order": 0}, "reasons": [reason, "no gravity"], "budget": {"tip.p": "0.1 mm"}}
    begun = step_result.isel(time=slice(0, 1)).assign_attrs(status="partial: coupling failed <at once>")
    warned = [{"member": "rod", "text": "<planar> is set", "count": 3, "time": 0.5}]
    begun.attrs["warnings"] = json.dumps(warned)
    return {**alone, "begun": begun, "chosen": step_result.assign_attrs(fidelity=json.dumps(chosen), title=reason)}


@pytest.mark.parametrize("name", ["thermal", "rod", "begun", "chosen"])
def test_pages_show_what_there_is(name: str, step_result: xr.Dataset, browser: Browser, tmp_path: Path) -> None:
    variant = variants(step_result)[name]
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


def test_a_page_is_one_small_file(step_result: xr.Dataset, tmp_path: Path) -> None:
    page.write(step_result, tmp_path / "new" / "step.html")
    assert [file.name for file in (tmp_path / "new").iterdir()] == ["step.html"]
    assert (tmp_path / "new" / "step.html").stat().st_size < 1.0e6


def test_pages_of_many_rows_stay_small(tmp_path: Path) -> None:
    """The largest of what an example gives: 3001 rows with fast changes."""
    page.write(tca.run("step", {"coupling.macro_step": 0.01}), tmp_path / "step.html")
    assert (tmp_path / "step.html").stat().st_size < 1.5e6
