"""Measures all codes in turn, several times over, and rates them against rod.fmu at equal or smaller error."""

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
from .release import PROBE, Code, Release, Setting

__all__ = ["CODES", "OURS", "Row", "compare", "rate", "show", "summary", "write"]

CODES = {"ours": "tca-cosim", "elastica": "pyelastica", "exudyn": "exudyn"}  # module here: distribution
OURS = "rod.fmu"
_CAPTION = """Error of the tip at 0.1 s, and the largest at 0.05, 0.1, 0.2, 0.5 and 1 s. Ratio: CPU time to that of the
fastest rod.fmu row with no larger error at 0.1 s; 10 ms: with outputs every 10 ms; largest: with no larger largest
error; spatial: to rows in space alone. inf: unstable; -: unknown, or none of ours is as good."""


@dataclass(frozen=True)
class Row:
    """Times in s of CPU per s simulated, median and quartiles; errors of the tip in um, at 0.1 s and the largest of the
    reference's times; ratios of the time to that of the fastest of our rows whose error is no larger. nan: unknown."""

    code: str
    damped: bool
    dim: int  # 2: planar
    setting: str
    every_10_ms: bool  # can be read so often at this cost
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


def compare(repeats: int = 5, modules: Sequence[str] = tuple(CODES)) -> tuple[list[Row], list[str]]:
    """Rated rows, and notes on machine, versions and codes that are not installed. A first round warms up."""
    codes, notes = _load(modules)
    with Archive(find_fmu("rod.fmu")) as archive:
        cases = [Release(archive, damped) for damped in (False, True)]
        runs = [(code, case, setting) for case in cases for code in codes for setting in code.settings(case.damped)]
        tips = [code.prepare(case, setting)() for code, case, setting in runs]
        truths = {(code, case): code.truth(case) for code, case, _ in runs}
        seconds = [[_cpu(code.prepare(case, setting)) for code, case, setting in runs] for _ in range(repeats)]
    quartiles = np.quantile(seconds, (0.25, 0.5, 0.75), axis=0).T / cases[0].times[-1]
    rows = [_row(*run, tip, truths[run[:2]], cpu) for run, tip, cpu in zip(runs, tips, quartiles, strict=True)]
    return rate(rows), notes


def rate(rows: Sequence[Row]) -> list[Row]:
    """The rows with their ratios."""

    def ratio(row: Row, error: str, *, often: bool = False, spatial: bool = False) -> float:
        ours = [r for r in rows if r.code == OURS and r.damped == row.damped and (r.every_10_ms or not often)]
        ours = [r for r in ours if getattr(r, error) <= getattr(row, error) and (r.dim == 3 or not spatial)]
        return row.cpu / min((r.cpu for r in ours), default=math.nan)

    def ratios(row: Row) -> dict[str, Any]:
        return {
            "ratio": ratio(row, "error"),
            "ratio_every_10_ms": ratio(row, "error", often=True),
            "ratio_largest": ratio(row, "largest_error"),
            "ratio_spatial": ratio(row, "error", spatial=True),
        }

    return [replace(row, **ratios(row)) for row in rows]


def summary(rows: Sequence[Row]) -> list[str]:
    """One line for every other code in every kind of case: how much more time it takes than ours at equal error."""
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


def show(rows: Sequence[Row]) -> Table:
    """A section for every code with and without damping; 80 columns hold it."""
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


def write(rows: Sequence[Row], notes: Sequence[str], path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {note}\n" for note in notes)
        table = csv.DictWriter(file, list(Row.__dataclass_fields__), lineterminator="\n")
        table.writeheader()
        table.writerows(asdict(row) for row in rows)


def _load(modules: Sequence[str]) -> tuple[list[Code], list[str]]:
    codes, notes = [], [f"{processor()}; Python {platform.python_version()}, numpy {np.__version__}"]
    for name in modules:
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # banners
                codes.append(import_module(f".{name}", __package__).CODE)
        except ImportError as error:
            notes.append(f"not run: {CODES[name]} cannot be imported ({error}); pip install 'tca-cosim[peers]'")
        else:
            notes.append(f"{codes[-1].name}: {CODES[name]} {_version(CODES[name])}; {codes[-1].remark}")
    return codes, notes


def _row(code: Code, case: Release, setting: Setting, tip: np.ndarray, truth: np.ndarray, cpu: np.ndarray) -> Row:
    error = 1e6 * np.linalg.norm(tip - truth, axis=1)
    at_probe, largest = float(error[np.isclose(case.times, PROBE)].item()), float(error.max())
    if not np.abs(tip).max() < 2 * case.length:
        largest = math.inf  # it was unstable, whether or not the truth is known
    text = ", ".join(f"{name} {value:g}" for name, value in setting.items())
    low, middle, high = map(float, cpu)
    often = setting.get("outputs", 100) >= 100
    dim = int(setting.get("dim", 3))
    return Row(code.name, case.damped, dim, text, often, middle, low, high, 1 / middle, at_probe, largest)


def _cpu(simulate: Callable[[], np.ndarray]) -> float:
    start = time.process_time()
    simulate()
    return time.process_time() - start


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "of this folder"
