"""docs/theory: every equation of the paper is found by its number, there and in the code that implements it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
THEORY = ROOT / "docs" / "theory"
EQUATIONS = range(1, 26)  # of the paper
CITATION = re.compile(r"\bEqs?\. (\d+)(?:(?:-| to | and )(\d+))?")
SUFFIXES = (".hpp", ".cpp", ".py")


def cited(text: str) -> set[int]:
    """Numbers of equations in "Eq. 4", "Eqs. 5-16", "Eqs. 5 to 16", "Eqs. 14 and 23"."""
    numbers: set[int] = set()
    for match in CITATION.finditer(text):
        first, last = int(match[1]), int(match[2] or match[1])
        numbers |= {first, last} if " and " in match[0] else set(range(first, last + 1))
    return numbers


def cited_in(path: Path) -> set[int]:
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.suffix in SUFFIXES]
    return set().union(*(cited(file.read_text(encoding="utf-8")) for file in files))


def index_rows() -> list[tuple[set[int], str, list[str]]]:
    """Rows of the table "Where each equation is": numbers, link, code paths."""
    text = (THEORY / "index.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (Eqs?\. [\d-]+) \|.*\| \[\]\(([^)]+)\) \| (.*) \|$", text, re.MULTILINE)
    return [(cited(numbers), link, re.findall(r"`([^`]+)`", code)) for numbers, link, code in rows]


def test_citations_are_read_right() -> None:
    assert cited("Eq. 4, Eqs. 5-7; Eqs. 9 to 11 but Eqs. 14 and 23, Eq 24") == {4, 5, 6, 7, 9, 10, 11, 14, 23}


def test_the_index_lists_every_equation_once() -> None:
    numbers = [number for row, _, _ in index_rows() for number in sorted(row)]
    assert numbers == list(EQUATIONS)


@pytest.mark.parametrize(("numbers", "link", "paths"), index_rows(), ids=[link for _, link, _ in index_rows()])
def test_page_and_code_cite_the_equation(numbers: set[int], link: str, paths: list[str]) -> None:
    page, anchor = link.split("#")
    text = (THEORY / page).read_text(encoding="utf-8")
    section = text.split(f"({anchor})=\n", 1)[1]
    heading = section.splitlines()[0]
    assert numbers <= cited(heading), heading
    assert paths
    for path in paths:
        assert numbers <= cited_in(ROOT / path), f"{path} does not cite {sorted(numbers - cited_in(ROOT / path))}"


def test_no_equation_is_cited_that_the_paper_does_not_have() -> None:
    for folder in ("fmus", "rod_fmu", "thermal_fmu", "orchestration", "docs"):
        assert cited_in(ROOT / folder) <= set(EQUATIONS), folder
