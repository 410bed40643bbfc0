"""A seeded sample of rods with wild parameters; wild_parameters.py runs long campaigns by hand."""

from __future__ import annotations

from wild_parameters import ROD, Fmu, campaign


def test_no_answer_is_wrong_without_a_word() -> None:
    counts, wrong = campaign(Fmu(ROD), 150, 0)
    assert wrong == []
    assert counts["refused"] > 0
    assert counts["complete"] + counts["complete, with a warning"] > 10
