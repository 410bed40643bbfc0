"""tca-cosim report: an HTML page of a result."""

from __future__ import annotations

from pathlib import Path

from .. import results
from .console import extra, partial_kept, reported, written
from .options import Against, Folder, Overrides
from .shown import From, MaybeScene, shown

__all__ = ["command"]


def command(
    scene: MaybeScene = None,
    override: Overrides = [],  # noqa: B006 (typer copies it)
    folder: Folder = Path("results"),
    source: From = None,
    against: Against = None,
) -> None:
    """Writes a result as one self-contained HTML page, NAME.html (requires tca-cosim[report]); of a run that fails
    NAME.partial.html."""
    with reported():
        with extra("report"):
            from ..visualization.report import page  # scikit-fem
        other = results.read(against) if against else None
        with partial_kept(folder, "html", page.write):
            result = shown(scene, override, source)
        path = folder / f"{result.attrs['scene']}.html"
        page.write(result, path, other)
        written(path)
