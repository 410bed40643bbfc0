"""tca-cosim performance: what runs cost on this machine, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .console import out, reported, written
from .options import Folder

__all__ = ["command"]


def command(
    section: Annotated[
        list[str], typer.Option(help="Section to measure; default: all but scipy, which takes a minute")
    ] = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    repeats: Annotated[int, typer.Option(min=1, help="Number of measurements; the fastest is reported")] = 7,
) -> None:
    """Measures start, parts of a run, many runs, scaling, memory and real time; writes performance.md."""
    with reported():
        from rich.table import Table

        from ..benchmarks.performance import SECTIONS, measure, write_page
        from ..errors import SceneError, similar

        wanted = section or [name for name in SECTIONS if name != "scipy"]
        for name in wanted:
            if name not in SECTIONS:
                raise SceneError(f"--section {name!r}: no such section; {similar(name, SECTIONS)}")
        sections = []
        for each in measure({name: SECTIONS[name] for name in wanted}, repeats):
            sections.append(each)
            table = Table(*each.columns, title=each.title)
            for row in each.rows:
                table.add_row(*row)
            out.print(table)
        write_page(folder / "performance.md", sections)
        written(folder / "performance.md")
