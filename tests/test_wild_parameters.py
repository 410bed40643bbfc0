"""A seeded sample of rods with wild parameters; wild_parameters.py runs long campaigns by hand."""

from __future__ import annotations

from pathlib import Path

import pytest
from wild_parameters import ROD, THERMAL, Fmu, campaign


@pytest.mark.parametrize(("path", "count"), [(ROD, 100), (THERMAL, 30)], ids=["rod", "thermal"])
def test_no_answer_is_wrong_without_a_word(path: Path, count: int) -> None:
    counts, wrong = campaign(Fmu(path), count, 0)
    assert wrong == []
    assert counts["refused"] > 0
    assert counts["complete"] + counts["complete, with a warning"] > 5


@pytest.mark.parametrize(("path", "count"), [(ROD, 16), (THERMAL, 40)], ids=["rod", "thermal"])
def test_mild_parameters_pass_their_audits(path: Path, count: int) -> None:
    counts, wrong = campaign(Fmu(path), count, 0, "mild")
    assert wrong == []
    assert counts["complete"] >= 3
    assert sum(number for what, number in counts.items() if what.startswith("audits: ")) >= 5
