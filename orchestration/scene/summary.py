"""A scene in words, for consoles and notebooks: duration, coupling, FMUs with inputs and changed parameters, wiring."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from html import escape
from typing import Any

from ..cosim.settings import Coupling
from ..cosim.signals import Constant, Signal
from ..cosim.topology import Connection
from ..fmi.archive import Variable
from .member import Member

__all__ = ["Summary"]


@dataclass(frozen=True)
class Summary:
    """What a scene consists of, to be shown."""

    name: str
    title: str
    stop_time: float  # [s]
    coupling: Coupling
    members: Sequence[Member]
    connections: Sequence[Connection]

    def text(self) -> str:
        """Write the title, then a line for each part."""
        parts = list(self._parts())
        width = max(len(name) for name, _ in parts)
        lines = [f"  {name:{width}}  {content}" for name, content in parts]
        return "\n".join([f"Scene {self.name!r}: {self.title}", *lines])

    def html(self) -> str:
        """Write the same as a table."""
        left = "style='text-align:left'"
        rows = [
            f"<tr><th {left}>{escape(name)}</th><td {left}>{escape(content)}</td></tr>"
            for name, content in self._parts()
        ]
        caption = f"<caption><b>Scene {escape(self.name)}</b>: {escape(self.title)}</caption>"
        return f"<table>{caption}{''.join(rows)}</table>"

    def _parts(self) -> Iterator[tuple[str, str]]:
        coupling = self.coupling
        yield "time", f"{self.stop_time:g} s in macro steps of {coupling.macro_step:g} s ({coupling.control})"
        yield "coupling", f"{coupling.method}, tolerance {coupling.tolerance:g}, {coupling.schedule}"
        for member in self.members:
            texts = (member.archive.path.name, _driven(member), _changed(member))
            yield member.name, "; ".join(filter(None, texts))
        if self.connections:
            wires = dict.fromkeys(re.sub(r"\[[\d,]+\]", "", str(c)) for c in self.connections)
            yield "wires", ", ".join(wires)


def _driven(member: Member) -> str:
    """Inputs with signals."""
    variables = member.archive.variables
    return ", ".join(f"{name} = {_signal(s)}{_unit(variables[name])}" for name, s in member.signals.items())


def _unit(variable: Variable) -> str:
    return "" if variable.unit in ("", "1") else f" {variable.unit}"


def _signal(signal: Signal) -> str:
    if isinstance(signal, Constant):
        return f"{signal.value:g}"
    values: Mapping[str, Any] = asdict(signal) if is_dataclass(signal) and not isinstance(signal, type) else {}
    return f"{type(signal).__name__.lower()}({', '.join(f'{key} {_number(value)}' for key, value in values.items())})"


def _number(value: float | Sequence[float]) -> str:
    if isinstance(value, float | int):
        return f"{value:.4g}"
    shown = [_number(item) for item in value[:6]] + ["..."] * (len(value) > 6)
    return f"[{', '.join(shown)}]"


def _changed(member: Member) -> str:
    """Parameters that differ from the start values of the FMU; enumerations by the names of their items."""
    texts = []
    for name, value in member.parameters.items():
        variable = member.archive.variables[name]
        if value != variable.start:
            shown = variable.item_name(float(value)) if variable.items else value
            texts.append(f"{name} {shown}{_unit(variable)}")
    return ", ".join(texts)
