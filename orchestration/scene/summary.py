"""A scene in words, for consoles and notebooks: what is run for how long, what drives it, what differs from the FMUs'
own defaults."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from html import escape
from typing import Any

__all__ = ["html", "text"]


def text(scene: Any) -> str:
    """Of a scene.Scene: its title, then a line for each of its parts."""
    parts = list(_parts(scene))
    width = max(len(name) for name, _ in parts)
    return "\n".join([f"Scene {scene.name!r}: {scene.title}", *(f"  {name:{width}}  {what}" for name, what in parts)])


def html(scene: Any) -> str:
    """The same as a table."""
    rows = (f"<tr><th style='text-align:left'>{escape(name)}</th>" for name, _ in _parts(scene))
    cells = (f"<td style='text-align:left'>{escape(what)}</td></tr>" for _, what in _parts(scene))
    caption = f"<caption><b>Scene {escape(scene.name)}</b>: {escape(scene.title)}</caption>"
    return f"<table>{caption}{''.join(a + b for a, b in zip(rows, cells, strict=True))}</table>"


def _parts(scene: Any) -> Iterator[tuple[str, str]]:
    coupling = scene.coupling
    yield "time", f"{scene.stop_time:g} s in macro steps of {coupling.macro_step:g} s ({coupling.control})"
    yield "coupling", f"{coupling.method}, tolerance {coupling.tolerance:g}, {coupling.schedule}"
    for member in scene.members:
        yield member.name, "; ".join(filter(None, [member.archive.path.name, _driven(member), _changed(member)]))
    if scene.connections:
        yield "wires", ", ".join(dict.fromkeys(re.sub(r"\[[\d,]+\]", "", str(c)) for c in scene.connections))


def _driven(member: Any) -> str:
    variables = member.archive.variables
    return ", ".join(f"{name} = {_signal(s)} {variables[name].unit}".rstrip(" 1") for name, s in member.signals.items())


def _signal(signal: Any) -> str:
    values = asdict(signal)
    if set(values) == {"value"}:
        return f"{signal.value:g}"
    return f"{type(signal).__name__.lower()}({', '.join(f'{key} {_number(value)}' for key, value in values.items())})"


def _number(value: float | Sequence[float]) -> str:
    return f"{value:.4g}" if isinstance(value, float | int) else f"[{', '.join(map(_number, value))}]"


def _changed(member: Any) -> str:
    """Parameters that are not as the FMU starts them; enumerations by their words."""
    found = []
    for name, value in member.parameters.items():
        about = member.archive.variables[name]
        if value != about.start:
            word = about.item_name(value) if about.items else value
            found.append(f"{name} {word}" + ("" if about.unit in ("", "1") else f" {about.unit}"))
    return ", ".join(found)
