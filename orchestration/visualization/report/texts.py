"""Texts and tables of the report, as HTML: how the run went, which models, all settings and versions."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from html import escape
from itertools import cycle
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from ...fmi.log import Warned
from ...results.comparison import Difference
from ...scene import Coupling
from ..assembly import Assembly
from ..manipulator import ZERO_CELSIUS, heat_members, members, rod_members
from ..measured import Deviation

__all__ = [
    "SLIDER_ROWS",
    "Readings",
    "body_card",
    "decimals",
    "deviations",
    "differences",
    "facts",
    "section_card",
    "settings",
    "time_readings",
]

SLIDER_ROWS = 201  # largest number of times of the slider
_MILLI = 1e3
_UNITS = {"m": ("mm", 1e3), "K": ("K", 1.0)}  # units of the page for those of a result, and their factor


@dataclass(frozen=True)
class Readings:
    """Voltage and temperature of each TCA beside the slider."""

    html: str
    texts: list[list[str]]  # for each TCA a text for each time


def body_card(bodies: Assembly) -> str:
    """Card of the view of the bodies."""
    several = len(bodies.manipulators) > 1
    arranged = " The scene does not place them: they stand side by side." if bodies.is_arranged else ""
    return (
        f"<div class='card'><h2>Manipulator{'s' if several else ''}</h2><p class='soft'>True radius; the colour of a "
        f"TCA is its mean temperature.{arranged} Drag or use the arrow keys to turn, + and - to zoom, 0 to reset.</p>"
        "<canvas id='body' tabindex='0' role='img' "
        f"aria-label='Manipulator{'s' if several else ''} in space; arrow keys turn the view'></canvas>"
        "<div class='scale' aria-hidden='true'><canvas class='colours' width='256' height='1'></canvas>"
        "<span class='low'></span><span>mean temperature [°C]</span><span class='high'></span></div></div>"
    )


def section_card(heat: str, gap: float) -> str:
    """Card of the cross-section; gap [K] between its means and those of the member `heat`."""
    return (
        "<div class='card'><h2>Temperature of the cross-section</h2><p class='soft'>Finite elements with the powers of "
        f"{escape(heat)}; the means over the TCAs agree with its own to {gap:.1g} K.</p>"
        "<canvas id='section' role='img' aria-label='Temperature of the cross-section, seen from the tip'></canvas>"
        "<p class='soft'><output id='probe'>Point at the section to read a temperature.</output></p></div>"
    )


def decimals(times: np.ndarray) -> int:
    """Number of decimals that tells the times of the slider apart."""
    return max(0, 3 - int(np.floor(np.log10(times[-1] or 1.0))))


def time_readings(result: xr.Dataset, rows: np.ndarray) -> Readings:
    """Temperatures of the TCAs, with voltages unless rods have the TCAs of several heat models."""
    heats, rods = heat_members(result), rod_members(result)
    owners = heats if not rods or (len(heats) == len(rods) == 1) else rods
    readings: list[tuple[str, list[str]]] = []
    for owner in owners:
        named = f" of {owner}" if len(owners) > 1 else ""
        celsius = result[f"{owner}.T"].to_numpy()[rows].T - ZERO_CELSIUS
        texts = [[f"{T:.1f} °C" for T in curve] for curve in celsius]
        if owner in heats:
            volts = result[f"{owner}.V"].to_numpy()[rows].T
            texts = [
                [f"{V:.2f} V, {text}" for V, text in zip(*pair, strict=True)] for pair in zip(volts, texts, strict=True)
            ]
        readings += [(f"TCA {k}{named}", course) for k, course in enumerate(texts, 1)]
    html = "".join(
        f"<span class='reading'><i class='swatch' style='--c: var(--c{colour})'></i>{escape(label)} "
        f"<span id='reading-{k}'></span></span>"
        for k, (colour, (label, _)) in enumerate(zip(cycle(range(8)), readings, strict=False))
    )
    return Readings(html, [texts for _, texts in readings])


def facts(result: xr.Dataset) -> str:
    """Outcome of the run in a few numbers, as list items."""
    status = str(result.attrs.get("status", "unknown"))
    items = [("status", "complete" if status == "complete" else "ended early")]
    items += [("time simulated", f"{float(result['time'][-1]):g} s"), *_end_state(result), *_coupling(result)]
    listed = "".join(f"<li><b>{escape(value)}</b><span>{escape(name)}</span></li>" for name, value in items)
    return listed if status == "complete" else f"{listed}<li class='bad'>{escape(status)}</li>"


def _end_state(result: xr.Dataset) -> list[tuple[str, str]]:
    items = []
    for rod in (rods := rod_members(result)):
        position = ", ".join(f"{_MILLI * x + 0.0:.2f}" for x in result[f"{rod}.tip.p"].to_numpy()[-1])
        named = f"{rod}: " if len(rods) > 1 else ""
        items.append((f"{named}tip x, y, z at the end", f"{position} mm"))
    hottest = []
    for heat in (names := heat_members(result)):
        T = result[f"{heat}.T"].to_numpy() - ZERO_CELSIUS
        row, tca = np.unravel_index(int(T.argmax()), T.shape)
        where = f"TCA {int(tca) + 1}" + (f" of {heat}" if len(names) > 1 else "")
        hottest.append((float(T.max()), f"hottest: {where} at {float(result['time'][row]):.3g} s"))
    if hottest:
        T_max, text = max(hottest)
        items.append((text, f"{T_max:.1f} °C"))
    return items


def _coupling(result: xr.Dataset) -> list[tuple[str, str]]:
    steps = result.sizes["time"] - 1
    items = [("macro steps", str(steps))]
    if "coupling.sweeps" in result and steps:
        gain = result["coupling.gain"].to_numpy()
        gain = gain[np.isfinite(gain)]
        items.append(("sweeps per step, mean", f"{float(result['coupling.sweeps'][1:].mean()):.2f}"))
        items.append(("loop gain, largest", f"{gain.max():.3g}" if gain.size else "not needed"))
        if gain.size:
            items.append(("coupling error, largest", f"{float(result['coupling.error'].max()):.1e} of nominal"))
    return items


def differences(table: Sequence[Difference]) -> str:
    """Table of the differences to another result, the largest relative to its range first."""
    rows = []
    for one in sorted(table, key=lambda d: -d.most / d.span if d.span else 0.0):
        numbers = _scaled((one.most, one.rms, one.span), one.unit)
        rows.append((one.name, *numbers, f"{one.time:.4g} s"))
    heads = ("quantity", "largest difference", "root mean square", "range of the quantity", "time of the largest")
    return _wide_table("Comparison", heads, rows)


def deviations(table: Iterable[Deviation]) -> str:
    """Table of the differences from measured samples."""
    rows = [(one.name, str(one.samples), *_scaled((one.rms, one.most), one.unit), f"{one.time:.4g} s") for one in table]
    heads = ("quantity", "samples", "root mean square", "largest difference", "time of the largest")
    return _wide_table("Measured", heads, rows)


def _scaled(values: Iterable[float], unit: str) -> list[str]:
    """Write numbers in the unit in which the report shows them."""
    shown, factor = _UNITS.get(unit, (unit, 1.0))
    return [f"{factor * value:.3g}" + ("" if shown == "1" else f" {shown}") for value in values]


def _wide_table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th scope='col'>{name}</th>" for name in heads)
    lines = (
        f"<tr><th scope='row'>{escape(name)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for name, *cells in rows
    )
    return (
        f"<h2>{title}</h2><div class='card wide' tabindex='0'><table><thead><tr>{head}</tr></thead>"
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def settings(result: xr.Dataset) -> str:
    """Sections: choice of models where one was made, settings of coupling and members, scene, versions."""
    units = {field.name: field.metadata["declaration"].unit for field in fields(Coupling)}
    connections = "\n".join(_read(result, "connections"))
    cards = [
        _card("Coupling", _table(_read(result, "coupling"), units) + _folded("Connections", _verbatim(connections)))
    ]
    for name, member in members(result).items():
        inputs = {key: _signal(*signal) for key, signal in member["signals"].items()}
        input_units = {key: result[f"{name}.{key.partition('[')[0]}"].attrs["units"] for key in inputs}
        folded = _folded(
            "Parameters", _table(member["parameters"] | member.get("choices", {}), member.get("units", {}))
        )
        cards.append(_card(f"{name} ({member['fmu']})", _table(inputs, input_units) + folded))
    sources = (f"<h4>{escape(Path(origin).name)}</h4>{_verbatim(text)}" for origin, text in _read(result, "sources"))
    cards.append(_card("Scene", _folded("As written", "".join(sources))))
    cards.append(_card("Versions", _table(_read(result, "versions"))))
    chosen = _warnings(result) + _fidelity(_read(result, "fidelity"))
    return f"{chosen}<h2>Settings</h2><section class='texts'>{''.join(cards)}</section>"


def _warnings(result: xr.Dataset) -> str:
    """List of what the FMUs warned of and of the notes of the master, where there are any."""
    texts = [str(Warned(**record)) for record in _read(result, "warnings")]
    texts += [str(note) for note in _read(result, "notes")]
    listed = "".join(f"<li>{escape(text)}</li>" for text in texts)
    return f"<h2>Warnings</h2><div class='card'><ul>{listed}</ul></div>" if listed else ""


def _fidelity(chosen: Mapping[str, Any]) -> str:
    if not chosen:
        return ""
    reasons = "".join(f"<li>{escape(str(reason))}</li>" for reason in chosen.get("reasons", ()))
    cards = [_card("Choice", _table(chosen.get("choice", {}))), _card("Reasons", f"<ul>{reasons}</ul>")]
    for key, value in chosen.items():
        if key not in ("choice", "reasons"):
            cards.append(_card(key.capitalize(), _table(value if isinstance(value, Mapping) else {key: value})))
    return f"<h2>Choice of models</h2><section class='texts'>{''.join(cards)}</section>"


def _table(rows: Mapping[str, Any], units: Mapping[str, str] = MappingProxyType({})) -> str:
    def line(key: str, value: Any) -> str:
        unit = f" {units[key]}" if units.get(key, "1") != "1" else ""
        return f"<tr><th scope='row'>{escape(key)}</th><td>{escape(_text(value) + unit)}</td></tr>"

    return f"<table>{''.join(line(str(key), value) for key, value in rows.items())}</table>" if rows else ""


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_text(item)}" for key, item in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(map(_text, value))
    return str(value)


def _signal(kind: str, values: Mapping[str, Any]) -> str:
    return _text(values["value"]) if kind == "Constant" else f"{kind.lower()}: {_text(values)}"


def _verbatim(text: str) -> str:
    return f"<pre tabindex='0'>{escape(text)}</pre>"


def _folded(title: str, content: str) -> str:
    return f"<details><summary>{escape(title)}</summary>{content}</details>"


def _card(title: str, content: str) -> str:
    return f"<div class='card'><h3>{escape(title)}</h3>{content}</div>"


def _read(result: xr.Dataset, key: str) -> Any:
    return json.loads(result.attrs.get(key, "{}"))
