"""tca-cosim report: an HTML page of a result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .. import results
from .console import extra, partial_kept, reported, written
from .options import Against, Folder, Overrides
from .shown import From, MaybeScene, shown

__all__ = ["command"]

Measured = Annotated[
    Path | None,
    typer.Option(
        metavar="SAMPLES.csv",
        help="Measured samples to show beside the curves: the time in the first column, others named as in a result, "
        "with units: rod.tip.p[1] [mm]",
    ),
]


def command(
    scene: MaybeScene = None,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    source: From = None,
    against: Against = None,
    measured: Measured = None,
) -> None:
    """Writes a result as one self-contained HTML page, NAME.html (requires tca-cosim[report]).

    A run that fails gives NAME.partial.html.
    """
    with reported():
        with extra("report"):
            from ..visualization.measured import check_file, read_measured
            from ..visualization.report import page  # scikit-fem
        if measured:
            check_file(measured)
        other = results.read(against) if against else None
        with partial_kept(folder, "html", page.write):
            result = shown(scene, override, source)
        path = folder / f"{result.attrs['scene']}.html"
        page.write(result, path, other, read_measured(measured, result) if measured else None)
        written(path)
