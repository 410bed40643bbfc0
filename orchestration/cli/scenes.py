"""tca-cosim list: scenes and sweeps of the package."""

from __future__ import annotations

from rich.table import Table

from ..scene import titles
from .console import out, reported

__all__ = ["command"]


def command() -> None:
    """Lists the scenes and sweeps that come with the package."""
    with reported():
        for kind in ("scene", "sweep"):
            table = Table(kind, "title")
            shipped = titles(f"{kind}s")
            for name, (title, _) in shipped.items():
                table.add_row(name, title)
            out.print(table)
            folder = next(path.parent for _, path in shipped.values())
            out.print(f"files: {folder}", highlight=False, soft_wrap=True)
