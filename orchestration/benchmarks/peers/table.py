"""Measurement of all codes in turn, repeatedly, and their ratios to rod.fmu at equal or smaller error."""

from __future__ import annotations

import contextlib
import csv
import io
import math
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import import_module, metadata
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from ...fmi.archive import Archive, find_fmu
from ...results.provenance import processor
from .release import PROBE, Code, ReleaseProblem, Setting

__all__ = ["CODES", "OURS", "PeerRow", "compare_peers", "peer_table", "summary", "with_ratios", "write"]

# module of this package -> distribution
CODES = {"ours": "tca-cosim", "elastica": "pyelastica", "exudyn": "exudyn", "soromox": "soromox"}
_ALONE = ("soromox",)  # not in the extra `peers`: JAX is large
OURS = "rod.fmu"
_CAPTION = """Error of the tip at 0.1 s, and the largest at 0.05, 0.1, 0.2, 0.5 and 1 s. Ratio: CPU time to that of the
fastest rod.fmu row with no larger error at 0.1 s; 10 ms: with outputs every 10 ms; largest: with no larger largest
error; spatial: to rows in space alone. inf: unstable; -: unknown, or none of ours is as good."""


@dataclass(frozen=True)
class PeerRow:
    """One setting of one code.

    Times are CPU seconds per second simulated, median and quartiles; errors of the tip in um, at 0.1 s and the largest
    at the reference's times; ratios of the time to that of the fastest of our rows whose error is no larger. nan:
    unknown.
    """

    code: str
    damped: bool
    dim: int  # 2: planar
    setting: str
    every_10_ms: bool  # whether outputs every 10 ms cost no more
    cpu: float
    cpu_low: float
    cpu_high: float
    times_real_time: float
    error: float
    largest_error: float
    ratio: float = math.nan
    ratio_every_10_ms: float = math.nan  # to our rows of that kind alone
    ratio_largest: float = math.nan  # at equal largest error
    ratio_spatial: float = math.nan  # to our rows in space alone


def compare_peers(repeats: int = 5, modules: Sequence[str] = tuple(CODES)) -> tuple[list[PeerRow], list[str]]:
    """Measure all codes: rows with ratios, and notes on machine, versions and codes that are not installed.

    A first round warms up.
    """
    codes, notes = _load(modules)
    with Archive(find_fmu("rod.fmu")) as archive:
        cases = [ReleaseProblem(archive, damped) for damped in (False, True)]
        runs = [(code, case, setting) for case in cases for code in codes for setting in code.settings(case.damped)]
        tips = [code.prepare(case, setting)() for code, case, setting in runs]
        references = {(code, case): code.reference(case) for code, case, _ in runs}
        seconds = [[_cpu(code.prepare(case, setting)) for code, case, setting in runs] for _ in range(repeats)]
    quartiles = np.quantile(seconds, (0.25, 0.5, 0.75), axis=0).T / cases[0].times[-1]
    rows = [_row(*run, tip, references[run[:2]], cpu) for run, tip, cpu in zip(runs, tips, quartiles, strict=True)]
    return with_ratios(rows), notes


def with_ratios(rows: Sequence[PeerRow]) -> list[PeerRow]:
    """The rows with their ratios."""

    def ratio(row: PeerRow, error: str, *, often: bool = False, spatial: bool = False) -> float:
        ours = [r for r in rows if r.code == OURS and r.damped == row.damped and (r.every_10_ms or not often)]
        ours = [r for r in ours if getattr(r, error) <= getattr(row, error) and (r.dim == 3 or not spatial)]
        return row.cpu / min((r.cpu for r in ours), default=math.nan)

    def ratios(row: PeerRow) -> dict[str, Any]:
        return {
            "ratio": ratio(row, "error"),
            "ratio_every_10_ms": ratio(row, "error", often=True),
            "ratio_largest": ratio(row, "largest_error"),
            "ratio_spatial": ratio(row, "error", spatial=True),
        }

    return [replace(row, **ratios(row)) for row in rows]


def summary(rows: Sequence[PeerRow]) -> list[str]:
    """One line for every other code and kind of case: its CPU time over ours at equal error."""
    columns = {"ratio": "to ours", "ratio_every_10_ms": "every 10 ms", "ratio_spatial": "in space"}
    lines = []
    kinds = dict.fromkeys((r.code, r.dim, r.damped) for r in rows if r.code != OURS)
    for code, dim, damped in kinds:
        alike = [r for r in rows if (r.code, r.dim, r.damped) == (code, dim, damped)]
        spans = []
        for column, words in columns.items():
            known = [value for r in alike if not math.isnan(value := getattr(r, column))]
            spans.append(f"{words} {min(known):.3g} to {max(known):.3g}" if known else f"{words} unknown")
        case = f"{code}, {'planar' if dim == 2 else 'spatial'}, {'damped' if damped else 'undamped'}"
        lines.append(f"{case}: CPU time at equal error, {', '.join(spans)} times")
    return lines


def peer_table(rows: Sequence[PeerRow]) -> Table:
    """Table with a section for every code with and without damping; it fits 80 columns."""
    heads = ("CPU\n[ms/s]", "error\n[um]", "largest\n[um]", "\nratio", "\n10 ms", "\nlargest", "\nspatial")
    table = Table("\nsetting", caption=_CAPTION, caption_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in heads:
        table.add_column(head, no_wrap=True)
    for (code, damped), alike in groupby(rows, lambda r: (r.code, r.damped)):
        table.add_row(f"{code}, {'damped' if damped else 'undamped'}", style="bold")
        for r in alike:
            ratios = (r.ratio, r.ratio_every_10_ms, r.ratio_largest, r.ratio_spatial)
            table.add_row(r.setting, *map(_short, (1e3 * r.cpu, r.error, r.largest_error, *ratios)))
        table.add_section()
    return table


def _short(number: float) -> str:
    return "-" if math.isnan(number) else f"{number:.3g}" if not 1e3 <= number < math.inf else f"{number:.0f}"


def write(rows: Sequence[PeerRow], notes: Sequence[str], path: Path) -> None:
    """Write a CSV file: the notes as comments, then one line per row."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {note}\n" for note in notes)
        table = csv.DictWriter(file, list(PeerRow.__dataclass_fields__), lineterminator="\n")
        table.writeheader()
        table.writerows(asdict(row) for row in rows)


def _load(modules: Sequence[str]) -> tuple[list[Code], list[str]]:
    codes, notes = [], [f"{processor()}; Python {platform.python_version()}, numpy {np.__version__}"]
    for name in modules:
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # banners
                codes.append(import_module(f".{name}", __package__).CODE)
        except ImportError as error:
            package = CODES[name] if name in _ALONE else "'tca-cosim[peers]'"
            notes.append(f"not run: {CODES[name]} cannot be imported ({error}); pip install {package}")
        else:
            notes.append(f"{codes[-1].name}: {CODES[name]} {_version(CODES[name])}; {codes[-1].remark}")
    return codes, notes


def _row(
    code: Code, case: ReleaseProblem, setting: Setting, tip: np.ndarray, reference: np.ndarray, cpu: np.ndarray
) -> PeerRow:
    error = 1e6 * np.linalg.norm(tip - reference, axis=1)
    at_probe, largest = float(error[np.isclose(case.times, PROBE)].item()), float(error.max())
    if not np.abs(tip).max() < 2 * case.length:
        largest = math.inf  # unstable, whether or not a reference is known
    text = ", ".join(f"{name} {value:g}" for name, value in setting.items())
    low, middle, high = map(float, cpu)
    often = setting.get("outputs", 100) >= 100
    dim = int(setting.get("dim", 3))
    return PeerRow(code.name, case.damped, dim, text, often, middle, low, high, 1 / middle, at_probe, largest)


def _cpu(simulate: Callable[[], np.ndarray]) -> float:
    start = time.process_time()
    simulate()
    return time.process_time() - start


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "of this folder"
