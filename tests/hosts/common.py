"""What every host in this folder runs: scene `step`, the rod closing its own loop (its default) and without inertia.
Each script is what a user of that host would write, started as

    python with_HOST.py SOURCE STEP TABLE

SOURCE: the folder of thermal.fmu and rod.fmu, or an SSP archive; STEP: the macro step [s]; TABLE: the CSV to write, a
row per macro step."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

STOP = 30.0  # s
VOLTS = {"V[1]": 0.0, "V[2]": 1.5, "V[3]": 3.0}
HEAT = ["T[1]", "T[2]", "T[3]"]  # K
TIP = ["tip.p[1]", "tip.p[2]", "tip.p[3]"]  # m


def arguments() -> tuple[Path, float, Path]:
    source, step, table = sys.argv[1:]
    return Path(source).resolve(), float(step), Path(table).resolve()


def save(table: Path, rows: Iterable[Sequence[float]]) -> None:
    """rows: time [s], HEAT, TIP."""
    with table.open("w", newline="") as file:
        csv.writer(file).writerows([["time", *HEAT, *TIP], *rows])
