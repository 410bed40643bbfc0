"""tca-cosim list: the scenes there are."""

from __future__ import annotations

from rich.table import Table

from ..scene import titles
from .console import out, reported

__all__ = ["command"]


def command() -> None:
    """The scenes that come with the package."""
    with reported():
        table = Table("scene", "title", "file")
        for name, (title, path) in titles().items():
            table.add_row(name, title, str(path))
        out.print(table)
