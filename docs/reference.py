"""Writes docs/reference.md: commands, scenes, sweeps, variables, each once, from where they are declared.

python docs/reference.py
"""

from __future__ import annotations

import inspect
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import typer
from tca_cosim import scene
from tca_cosim.cli import app
from tca_cosim.cosim import signals
from tca_cosim.fmi.archive import Archive, Variable, find_fmu
from tca_cosim.scene import columns, validation
from tca_cosim.scene.schema import declared
from tca_cosim.studies import sweep

__all__ = ["FILE", "folded", "text"]

FILE = Path(__file__).with_suffix(".md")
_NUMBER = re.compile(r"\d+")
HEAD = """# Reference

Written by `make reference` from the code and the FMUs; not by hand.
"""


def text() -> str:
    """The whole page."""
    parts = [HEAD, _commands(), _scenes(), _sweeps(), *(_fmu(name) for name in ("thermal", "rod"))]
    return "\n".join(part.strip() + "\n" for part in parts)


# -- commands


def _commands() -> str:
    commands = {name: c for name, c in typer.main.get_command(app).commands.items() if not c.hidden}
    counts = Counter(_parameter(p) for command in commands.values() for p in command.params)
    shared = [parameter for parameter, count in counts.items() if count > 1]
    head = ("argument or option", "default", "meaning")
    parts = ["## Commands", "What several commands take:", _table(head, shared)]
    for name, command in commands.items():
        words = [(p, p.opts[0] if _named(p) else p.metavar or p.name.upper()) for p in command.params]
        usage = [word if p.required else f"[{word}]" for p, word in words]
        parts += [f"### `{' '.join(['tca-cosim', name, *usage])}`", inspect.cleandoc(command.help or "")]
        own = [_parameter(p) for p in command.params if _parameter(p) not in shared]
        parts += [_table(head, own)] if own else []
    return "\n\n".join(parts)


def _named(parameter: Any) -> bool:
    return parameter.param_type_name == "option"


def _parameter(p: Any) -> tuple[str, str, str]:
    """Names, default, meaning."""
    names = [*p.opts, *p.secondary_opts] if _named(p) else [p.metavar or p.name.upper()]
    shown = "" if p.default is None or p.default == [] or isinstance(p.default, bool) else p.default
    return ", ".join(f"`{name}`" for name in names), str(getattr(shown, "value", shown)), p.help or ""


# -- scenes and sweeps


def _scenes() -> str:
    return "\n\n".join(
        [
            "## Scenes",
            'A TOML file. Numbers are in the unit of what they set, texts carry one, such as `"40 mm"`.',
            _table(("key", "what"), [(f"`{key}`", meaning) for key, meaning in scene.KEYS.items()]),
            *(
                part
                for name, kind in scene.TABLES.items()
                for part in (f"### Table `[{name}]`", inspect.cleandoc(kind.__doc__), _settings(kind))
            ),
            "### Signals",
            'An input is a constant, or one of these as a table, such as `{ steps = [["0 s", "3 V"], ["15 s", 0]] }`:',
            _signals(),
        ]
    )


def _sweeps() -> str:
    return "\n\n".join(
        [
            "## Sweeps",
            "A TOML file. " + inspect.cleandoc(sweep.SweepSettings.__doc__),
            _table(("key", "what"), [(f"`{key}`", meaning) for key, meaning in sweep.KEYS.items()]),
            _settings(sweep.SweepSettings),
        ]
    )


def _settings(kind: type) -> str:
    rows = [(f"`{name}`", _start(v), _unit(v), _range(v), v.description) for name, v in declared(kind).items()]
    return _table(("key", "default", "unit", "range or choices", "meaning"), rows)


def _signals() -> str:
    rows = []
    for name in validation.SIGNALS:
        if name == "table":
            course = "values of a column of a CSV or NetCDF file, joined by straight lines or held"
            rows.append((f"`{name}`", ", ".join(columns.ENTRIES), course))
            continue
        described = getattr(signals, name, None) or getattr(signals, name.capitalize())
        entries = [
            entry if default is None else f"{entry} ({default:g})"
            for entry, (_, default) in validation.SHAPES.get(name, {}).items()
        ]
        rows.append((f"`{name}`", ", ".join(entries) or "list of [time, value]", described.__doc__))
    return _table(("signal", "entries (default)", "course"), rows)


# -- FMUs


def _fmu(name: str) -> str:
    with Archive(find_fmu(f"{name}.fmu")) as archive:
        parts = [
            f"## {name}.fmu",
            f"{archive.model_description().description}. Equations, choices and limits: `documentation/index.html` in "
            "the FMU.",
        ]
        for causality, title in {
            "parameter": "Parameters",
            "input": "Inputs",
            "output": "Outputs",
            "local": "States and derivatives",
            "independent": "Time",
        }.items():
            rows = folded([v for v in archive.variables.values() if v.causality == causality])
            if rows:
                head = ("variable", "start", "unit", "range or choices", "meaning")
                parts += [f"### {title} of {name}.fmu", _table(head, rows)]
    return "\n\n".join(parts)


def folded(variables: Sequence[Variable]) -> list[tuple[str, ...]]:
    """Rows: name, start, unit, range, meaning.

    Elements of one vector that differ in numbers only share a row, such as T[1..3].
    """
    groups: dict[tuple[str, ...], list[Variable]] = {}
    for v in variables:
        groups.setdefault((_NUMBER.sub("#", v.name), v.unit, _range(v), _NUMBER.sub("#", v.description)), []).append(v)
    return [
        (
            f"`{_span([v.name for v in group])}`",
            ", ".join(dict.fromkeys(_start(v) for v in group)),
            _unit(group[0]),
            _range(group[0]),
            _span([re.sub(r"(?<=\w)\[[\d,]+\]", "", v.description) for v in group]),
        )
        for group in groups.values()
    ]


def _span(texts: Sequence[str]) -> str:
    """One text for all, where numbers differ as 1..3."""
    numbers = [sorted({int(n) for n in column}) for column in zip(*map(_NUMBER.findall, texts), strict=True)]
    shown = iter(f"{column[0]}..{column[-1]}" if len(column) > 1 else None for column in numbers)
    return _NUMBER.sub(lambda match: next(shown) or match[0], texts[0])


def _unit(v: Variable) -> str:
    return "" if v.unit == "1" else v.unit


def _start(v: Variable) -> str:
    if isinstance(v.start, bool):
        return str(v.start).lower()
    if isinstance(v.start, str) or v.start is None:
        return v.start or ""
    return v.items[int(v.start) - 1] if v.items else f"{v.start:.6g}"


def _range(v: Variable) -> str:
    if v.items:
        return ", ".join(v.items)
    if v.type == "Boolean":
        return "true, false"
    ends = [f"from {v.least:.6g}"] if v.least > float("-inf") else []
    return " ".join([*ends, *([f"to {v.most:.6g}"] if v.most < float("inf") else [])])


# -- Markdown


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(str(cell)) for cell in line) + " |" for line in lines)


def _cell(content: str) -> str:
    return re.sub(r"\s+", " ", content).strip().replace("|", "\\|")


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
    print(f"written: {FILE}")
