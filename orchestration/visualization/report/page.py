"""Report of a result as one HTML page that needs nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ...errors import CosimError
from ...files import atomic_write
from ...results.comparison import Difference, compare
from ..assembly import Assembly, assembly
from ..charts import Chart, charts, in_unit
from ..manipulator import ZERO_CELSIUS, rod_member, section_member, section_rod, select_rows
from ..measured import Measured
from .body import body_data, temperature_range
from .document import ChartCard, Document, pack, pack_small, plasma, section_of_charts
from .field import Field, field
from .svg import draw
from .texts import (
    SLIDER_ROWS,
    body_card,
    decimals,
    deviations,
    differences,
    facts,
    section_card,
    settings,
    time_readings,
)

__all__ = ["html", "write"]

_MILLI = 1e3


def write(result: xr.Dataset, path: Path, other: xr.Dataset | None = None, measured: Measured | None = None) -> None:
    """Write the page of a result, complete or partial; the file appears whole or not at all.

    With another result the page compares the two, and shows measured samples beside the curves. Raises CosimError where
    the results have nothing in common.
    """
    text = html(result, other, measured)
    with atomic_write(path) as draft:
        draft.write_text(text, encoding="utf-8")


def html(result: xr.Dataset, other: xr.Dataset | None = None, measured: Measured | None = None) -> str:
    """Page of a result. Parts that the result has no data for are left out."""
    rows = select_rows(result, SLIDER_ROWS)
    times = result["time"].to_numpy()[rows]
    heat = section_member(result)
    bodies = assembly(result, rows) if rod_member(result) else None
    seen = field(result, heat, rows) if heat else None
    cards, readings = _chart_cards(result, rows, other, measured), time_readings(result, rows)
    kelvin = [*([bodies.temperatures] if bodies else []), *([seen.extremes] if seen else [])]
    views = ([body_card(bodies)] if bodies else []) + ([section_card(str(heat), seen.gap)] if seen else [])
    return Document(
        title=str(result.attrs.get("title", "Result")),
        subtitle=_subtitle(result, other, measured),
        facts=facts(result),
        readings=readings.html,
        views=f"<section class='views{' one' if len(views) == 1 else ''}'>{''.join(views)}</section>" if views else "",
        charts=_charts_section(cards),
        texts=(differences(_compare(result, other)) if other is not None else "")
        + (deviations(measured.deviations(result)) if measured else "")
        + settings(result),
        last=rows.size - 1,
        data={
            "times": times.tolist(),
            "decimals": decimals(times),
            "readings": readings.texts,
            "charts": [_chart_data(card) for card in cards],
            "colours": plasma(),
            "range": temperature_range(*kelvin) if kelvin else None,
            "body": body_data(bodies, _other_bodies(other, times), section_rod(result)) if bodies else None,
            "section": _section_data(seen) if seen else None,
        },
    ).html()


def _subtitle(result: xr.Dataset, other: xr.Dataset | None, measured: Measured | None) -> str:
    text = f"Scene {result.attrs.get('scene', '?')}, computed by tca-cosim"
    if other is not None:
        text += f"; dotted curves and the outline of the body: {other.attrs.get('title', 'another result')}"
    return text if measured is None else f"{text}; circles: measured, {measured.file}"


def _compare(result: xr.Dataset, other: xr.Dataset) -> tuple[Difference, ...]:
    try:
        return compare(result, other)
    except ValueError as error:
        raise CosimError(str(error)) from error


def _other_bodies(other: xr.Dataset | None, times: np.ndarray) -> Assembly | None:
    """Bodies of the other result at its rows nearest to times, where it has a rod."""
    if other is None or not rod_member(other):
        return None
    nearest = np.abs(other["time"].to_numpy() - times[:, None]).argmin(axis=1)
    return assembly(other, nearest)


def _chart_cards(
    result: xr.Dataset, rows: np.ndarray, other: xr.Dataset | None, measured: Measured | None
) -> list[ChartCard]:
    times = result["time"].to_numpy()
    others = {} if other is None else {chart.title: chart for chart in charts(other)}
    other_times = times if other is None else other["time"].to_numpy()
    cards = []
    for number, chart in enumerate(charts(result, measured.values if measured else ())):
        twin = others.get(chart.title)
        curves = {line.label: line.values for line in twin.lines} if twin and twin.unit == chart.unit else {}
        if chart.lines:
            samples = _samples(chart, result, measured) if measured else {}
            cards.append(ChartCard(chart, draw(number, chart, times, curves, other_times, samples), rows))
    return cards


def _samples(chart: Chart, result: xr.Dataset, measured: Measured) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Measured samples of a chart's lines in its unit, within the time of the result."""
    course = result["time"].to_numpy()
    samples = {}
    for line in chart.lines:
        if line.name in measured.values:
            times, values = measured.samples(line.name)
            unit = result[line.name.partition("[")[0]].attrs.get("units", "1")
            inside = (times >= course[0]) & (times <= course[-1])
            samples[line.name] = (times[inside], in_unit(values[inside], unit, chart.unit))
    return samples


def _charts_section(cards: list[ChartCard]) -> str:
    if not cards:
        return ""
    return (
        "<h2>Over time</h2>"
        "<p class='soft'>Click into a chart to go to that time; the legends show the values there.</p>"
        f"<section class='charts'>{section_of_charts(cards)}</section>"
    )


def _chart_data(card: ChartCard) -> dict[str, Any]:
    drawing = card.drawing
    return {
        "left": round(drawing.left, 2),
        "right": round(drawing.right, 2),
        "first": drawing.first,
        "last": drawing.last,
        "unit": "" if card.chart.unit == "1" else f" {card.chart.unit}",
        "values": [pack(line.values[card.rows]) for line in card.chart.lines],
    }


def _section_data(seen: Field) -> dict[str, Any]:
    section = seen.section
    return {
        "points": seen.raster.shape[0],
        "modes": seen.courses.shape[1],
        "zero": seen.T_0 - ZERO_CELSIUS,
        "courses": pack(seen.courses),
        "raster": pack_small(seen.raster),
        "radius": _MILLI * section.radius,
        "centres": (_MILLI * section.centres).round(4).tolist(),
        "outer": [_MILLI * radius for radius in section.outer_radius],
        "inner": [_MILLI * radius for radius in section.inner_radius],
    }
