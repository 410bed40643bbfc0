"""tca-cosim list: the scenes and sweeps there are."""

from __future__ import annotations

from rich.table import Table

from ..scene import titles
from .console import out, reported

__all__ = ["command"]


def command() -> None:
    """The scenes and sweeps that come with the package."""
    with reported():
        for kind in ("scene", "sweep"):
            table = Table(kind, "title", "file")
            for name, (title, path) in titles(f"{kind}s").items():
                table.add_row(name, title, str(path))
            out.print(table)
