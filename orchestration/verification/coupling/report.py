"""Files of a verification: JSON for machines, one HTML page for people."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...files import atomic_write
from ...results.software import versions
from .verify import VERDICTS, Verification

__all__ = ["as_json", "write_html", "write_json"]

_GOOD = ("settled", "constant", "count")  # kinds of outputs that speak for the result
_RESULTS = {True: "passed", False: "broken", None: "-"}
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
h1 { font-size: 1.4rem; } h2 { font-size: 1.1rem; margin-top: 2rem; }
.verdict { padding: .8rem 1rem; border-left: .4rem solid; background: #f6f6f6; }
.good { border-color: #2a7f3f; } .bad { border-color: #b3261e; }
table { border-collapse: collapse; width: 100%; } .wide { overflow-x: auto; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid #ddd; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.mark-good { color: #2a7f3f; } .mark-bad { color: #b3261e; font-weight: 600; } .mark-none { color: #777; }
"""


def as_json(verification: Verification) -> dict[str, Any]:
    """The verification as plain data; numbers that are not finite become None."""
    v = verification
    return _plain(
        {
            "system": v.scene.name,
            "title": v.scene.title,
            "verdict": v.verdict,
            "trusted": v.trusted,
            "meaning": VERDICTS[v.verdict],
            "reasons": v.reasons,
            "tolerance": v.tolerance,
            "runs": [
                {
                    "step_s": run.step,
                    "steps": run.times.size - 1,
                    "shortest_step_s": run.shortest,
                    "sweeps": run.sweeps,
                    "residual": run.residual,
                    "gain": run.gain,
                    "failure": run.failure,
                }
                for run in v.runs
            ],
            "members": {name: [asdict(check) for check in checks] for name, checks in v.checks.items()},
            "loops": asdict(v.loops),
            "signals": [asdict(signal) for signal in v.signals],
            "power_bonds": [
                {
                    "forward": str(bond.forward),
                    "backward": str(bond.backward),
                    "shares": bond.shares,
                    "closed": bond.closed,
                    "text": bond.text,
                }
                for bond in v.bonds
            ],
            "monolith": asdict(v.monolith),
            "versions": versions(),
        }
    )


def write_json(verification: Verification, path: Path) -> None:
    """Write as_json() to a file."""
    with atomic_write(path) as draft:
        draft.write_text(json.dumps(as_json(verification), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def write_html(verification: Verification, path: Path) -> None:
    """Write one page that stands alone."""
    with atomic_write(path) as draft:
        draft.write_text(_page(verification), encoding="utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, bool) or value is None or isinstance(value, int | str):
        return value
    return float(value) if math.isfinite(value) else None


def _page(v: Verification) -> str:
    text = html.escape
    parts = [
        f"<h1>{text(v.scene.title)}</h1>",
        f'<div class="verdict {"good" if v.trusted else "bad"}"><strong>{text(v.verdict.capitalize())}.</strong> '
        f"{text(VERDICTS[v.verdict])} Tolerance: {100.0 * v.tolerance:g} % of the range of every output.</div>",
        "<h2>Why</h2><ul>" + "".join(f"<li>{text(reason)}</li>" for reason in v.reasons[:20]) + "</ul>",
        "<h2>Outputs</h2>",
        _table(
            ("output", "verdict", "error with H", "order", "in words"),
            [
                (
                    s.name,
                    _mark(s.kind in ("settled", "constant", "count"), s.kind),
                    _number(s.error),
                    _number(s.order),
                    s.text,
                )
                for s in v.signals
            ],
        )
        if v.signals
        else "<p>No two runs reached their end, so that outputs cannot be compared.</p>",
        "<h2>FMUs</h2>",
        _table(
            ("FMU", "test", "result", "in words"),
            [
                (
                    name,
                    check.name,
                    _mark(check.passed, {True: "passed", False: "broken", None: "-"}[check.passed]),
                    check.text,
                )
                for name, checks in v.checks.items()
                for check in checks
            ],
        ),
        "<h2>Runs</h2>",
        _table(
            ("macro step [s]", "steps", "sweeps", "residual", "gain", "end"),
            [
                (
                    f"{run.step:.4g}",
                    str(run.times.size - 1),
                    _number(run.sweeps),
                    _number(run.residual),
                    _number(run.gain),
                    run.failure or "complete",
                )
                for run in v.runs
            ],
        ),
        f"<h2>Loops</h2><p>{text(v.loops.text)}</p>",
        "<h2>Power bonds</h2>",
        _table(
            ("bond", "result", "in words"),
            [
                (f"{b.forward}, {b.backward}", _mark(b.closed, "closed" if b.closed else "open"), b.text)
                for b in v.bonds
            ],
        )
        if v.bonds
        else "<p>The units of the connections make no power bond.</p>",
        f"<h2>Monolith</h2><p>{text(v.monolith.text)}</p>",
    ]
    head = (
        '<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{text(v.scene.name)}: {text(v.verdict)}</title><style>{_STYLE}</style>"
    )
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n' + "\n".join(parts) + "\n</body></html>\n"


class _Html(str):
    """Text that is HTML already."""


def _mark(good: bool | None, word: str) -> _Html:
    kind = "none" if good is None else "good" if good else "bad"
    return _Html(f'<span class="mark-{kind}">{html.escape(word)}</span>')


def _number(value: float) -> _Html:
    return _Html(f"{value:.3g}" if math.isfinite(value) else "-")


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["<tr>" + "".join(f"<th>{html.escape(head)}</th>" for head in heads) + "</tr>"]
    for row in rows:
        cells = (cell if isinstance(cell, _Html) else html.escape(cell) for cell in row)
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return '<div class="wide"><table>\n' + "\n".join(lines) + "\n</table></div>"
