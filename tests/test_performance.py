"""The page of measurements: its sections, its tables and where it was measured; how long things take is not tested."""

from __future__ import annotations

from pathlib import Path

import pytest
from tca_cosim.benchmarks.performance import SECTIONS, Section, measure, sections, write_page
from test_cli import tca as command


def test_the_page_says_where_it_was_measured(tmp_path: Path) -> None:
    write_page(tmp_path / "page.md", [Section("Start", ("command", "time"), [("`list`", "0.1 s")], "By the clock.")])
    text = (tmp_path / "page.md").read_text()
    assert "Measured with: processor " in text
    assert "load " in text
    assert text.endswith("## Start\n\nBy the clock.\n\n| command | time |\n| --- | --- |\n| `list` | 0.1 s |\n")


@pytest.mark.parametrize("name", ["parts", "runs", "heat", "orders", "realtime"])
@pytest.mark.slow
def test_sections_have_full_rows(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sections, "SCENES", ("tap",))
    monkeypatch.setattr(sections, "ORDERS", (0, 3))
    monkeypatch.setattr(sections, "NEIGHBOURS", 16)
    (section,) = measure({name: SECTIONS[name]}, 1)
    assert section.rows
    assert all(len(row) == len(section.columns) for row in section.rows)


def test_a_section_that_is_not_there_is_named(tmp_path: Path) -> None:
    done = command("performance", "--section", "memry", folder=tmp_path)
    assert done.returncode != 0
    assert "memory" in done.stderr
