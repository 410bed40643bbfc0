"""tca-cosim peers: comparison with other rod codes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..benchmarks import peers
from .console import out, reported, written
from .options import Folder

__all__ = ["command"]


def command(
    folder: Folder = Path("results"),
    repeats: Annotated[int, typer.Option(min=1, help="Number of timed rounds; the median is reported")] = 5,
) -> None:
    """Compares CPU times at equal error with PyElastica, Exudyn and SoRoMoX, on the release of a bare rod.

    Requires tca-cosim[peers].
    """
    with reported():
        rows, notes = peers.compare_peers(repeats)
        out.print(peers.peer_table(rows))
        out.print(*peers.summary(rows), *notes, sep="\n", highlight=False, soft_wrap=True)
        peers.write(rows, notes, folder / "peers.csv")
        written(folder / "peers.csv")
