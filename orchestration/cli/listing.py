"""What `tca-cosim list` prints: names and titles of scenes and sweeps, in columns."""

from __future__ import annotations

import shutil
import textwrap

from ..scene import titles
from .console import reported, say

__all__ = ["print_titles"]

LEAST_WIDTH = 40  # characters of a line, however narrow the terminal says that it is


def print_titles() -> None:
    """Print a table for scenes and one for sweeps, each with the folder of its files."""
    width = max(LEAST_WIDTH, shutil.get_terminal_size().columns)
    with reported():
        for kind in ("scene", "sweep"):
            shipped = titles(f"{kind}s")
            column = max(map(len, (kind, *shipped))) + 2
            rule = "-" * (column - 2)
            say(f"{kind:<{column}}title", f"{rule}  {'-' * max(len(title) for title, _ in shipped.values())}"[:width])
            for name, (title, _) in shipped.items():
                lines = textwrap.wrap(title, width - column) or [""]
                say(f"{name:<{column}}{lines[0]}", *(" " * column + line for line in lines[1:]))
            say(f"files: {next(path.parent for _, path in shipped.values())}", "")
