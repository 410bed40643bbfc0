"""Tables of measurements as a page in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...files import atomic_write
from ...results.provenance import commit, machine
from ...results.software import versions

__all__ = ["Section", "write_page"]


@dataclass(frozen=True)
class Section:
    """One table.

    Attributes
    ----------
    title : str
        What is measured.
    columns : sequence of str
        Headings.
    rows : sequence of sequence of str
        Cells.
    note : str
        How it was measured.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""

    def lines(self) -> list[str]:
        """Return the section in Markdown."""
        table = [self.columns, ["---"] * len(self.columns), *self.rows]
        note = [self.note, ""] if self.note else []
        return [f"## {self.title}", "", *note, *(f"| {' | '.join(row)} |" for row in table), ""]


def write_page(path: Path, sections: Iterable[Section]) -> None:
    """Write the sections with the machine, its load and the versions that they were measured with."""
    where = ", ".join(f"{key} {value}" for key, value in {**machine(), "commit": commit(), **versions()}.items())
    lines = ["# What runs cost", "", f"Measured with: {where}.", ""]
    for section in sections:
        lines += section.lines()
    with atomic_write(path) as draft:
        draft.write_text("\n".join(lines), encoding="utf-8")
