"""What a report says in words: how the run went, why these models, all settings and versions. HTML."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr

from ...scene import Coupling
from ..manipulator import members

__all__ = ["about", "facts"]


def facts(result: xr.Dataset) -> str:
    """The run in a few numbers, as list items."""
    status = str(result.attrs.get("status", "unknown"))
    steps = result.sizes["time"] - 1
    found = [("time simulated", f"{float(result['time'][-1]):g} s"), ("macro steps", str(steps))]
    if "coupling.sweeps" in result and steps:
        gain = result["coupling.gain"].to_numpy()
        known = gain[np.isfinite(gain)]
        found.append(("sweeps per step, mean", f"{float(result['coupling.sweeps'][1:].mean()):.2f}"))
        found.append(("loop gain, largest", f"{known.max():.3g}" if known.size else "not needed"))
        if known.size:
            found.append(("coupling error, largest", f"{float(result['coupling.error'].max()):.1e} of nominal"))
    items = [("status", status if status == "complete" else "ended early"), *found]
    listed = "".join(f"<li><b>{escape(value)}</b><span>{escape(name)}</span></li>" for name, value in items)
    return listed if status == "complete" else f"{listed}<li class='bad'>{escape(status)}</li>"


def about(result: xr.Dataset) -> str:
    """Sections: choice of fidelity where one was made, settings of coupling and members, scene, versions."""
    units = {field.name: field.metadata["declaration"].unit for field in fields(Coupling)}
    wires = "\n".join(_read(result, "connections"))
    cards = [_card("Coupling", _table(_read(result, "coupling"), units) + _folded("Connections", _verbatim(wires)))]
    for name, member in members(result).items():
        inputs = {key: _signal(*signal) for key, signal in member["signals"].items()}
        measured = {key: result[f"{name}.{key.partition('[')[0]}"].attrs["units"] for key in inputs}
        folded = _folded(
            "Parameters", _table(member["parameters"] | member.get("choices", {}), member.get("units", {}))
        )
        cards.append(_card(f"{name} ({member['fmu']})", _table(inputs, measured) + folded))
    sources = (f"<h3>{escape(Path(origin).name)}</h3>{_verbatim(text)}" for origin, text in _read(result, "sources"))
    cards.append(_card("Scene", _folded("As written", "".join(sources))))
    cards.append(_card("Versions", _table(_read(result, "versions"))))
    chosen = _fidelity(_read(result, "fidelity"))
    return f"{chosen}<h2>Settings</h2><section class='texts'>{''.join(cards)}</section>"


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
        return f"<tr><th>{escape(key)}</th><td>{escape(_text(value) + unit)}</td></tr>"

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
    return f"<pre>{escape(text)}</pre>"


def _folded(title: str, inside: str) -> str:
    return f"<details><summary>{escape(title)}</summary>{inside}</details>"


def _card(title: str, inside: str) -> str:
    return f"<div class='card'><h3>{escape(title)}</h3>{inside}</div>"


def _read(result: xr.Dataset, key: str) -> Any:
    return json.loads(result.attrs.get(key, "{}"))
