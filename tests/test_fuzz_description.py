"""A seeded sample of the fuzzing of modelDescription.xml; fuzz_description.py runs long campaigns by hand."""

from __future__ import annotations

from pathlib import Path

from fuzz_description import campaign


def test_descriptions_are_read_or_refused_in_one_line(tmp_path: Path) -> None:
    outcomes = campaign(400, 1, tmp_path)
    assert outcomes["read"] > 20
    assert len(outcomes) > 5
