"""tca-cosim verify: whether a coupled system can be trusted."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from ..scene import read
from .console import busy, out, reported, written
from .options import Folder, Overrides, SceneName

__all__ = ["command"]

RESULTS = {True: "passed", False: "broken", None: "-"}
MOST_REASONS = 8  # lines printed; the files have all


def command(
    scene: SceneName,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    tolerance: Annotated[
        float, typer.Option(min=1e-6, max=0.5, help="Error allowed in every output, share of its range")
    ] = 0.01,
) -> None:
    """Verifies a coupled system of any FMUs.

    Tests each FMU against its interface, runs macro steps H, H/2 and H/4, compares energies and the monolith; writes
    NAME.verify.html and .json. Exit code 0: can be trusted; 1: cannot.
    """
    from ..verification import coupling  # its solver takes long to load

    with reported():
        described = read(scene, override)
        with busy(described.name) as status:
            verification = coupling.verify(described, tolerance, status)
        names = list(dict.fromkeys(check.name for checks in verification.checks.values() for check in checks))
        table = Table("FMU", *names)
        for member, checks in verification.checks.items():
            results = {check.name: RESULTS[check.passed] for check in checks}
            table.add_row(member, *(results.get(name, "-") for name in names))
        out.print(table)
        kinds = Counter(signal.kind for signal in verification.signals)
        counted = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common()) or "not comparable"
        out.print(f"outputs: {counted}", highlight=False)
        out.print(f"verdict: {verification.verdict}. {coupling.VERDICTS[verification.verdict]}", highlight=False)
        for reason in verification.reasons[:MOST_REASONS]:
            out.print(f"  {reason}", highlight=False, soft_wrap=True)
        if len(verification.reasons) > MOST_REASONS:
            out.print(f"  and {len(verification.reasons) - MOST_REASONS} more in the files", highlight=False)
        coupling.write_json(verification, folder / f"{described.name}.verify.json")
        coupling.write_html(verification, folder / f"{described.name}.verify.html")
        written(folder / f"{described.name}.verify.html", ".json")
    if not verification.trusted:
        raise SystemExit(1)
