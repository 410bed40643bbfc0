"""Figures as files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from .whole import whole

__all__ = ["save"]


def save(
    figure: Figure, folder: Path, name: str, endings: Sequence[str] = ("png", "svg"), dpi: int = 110
) -> list[Path]:
    """folder/name.ending for each ending; the files written."""
    paths = [folder / f"{name}.{ending}" for ending in endings]
    for path in paths:
        with whole(path) as draft:
            figure.savefig(draft, dpi=dpi)
    return paths
