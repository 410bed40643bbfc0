"""Bodies of segments through the FMU: equilibria, energy, frequencies, cut bodies, against the bounds of the tool."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import body_errors
import pytest


@pytest.mark.parametrize(
    "rows", [body_errors.equilibria, body_errors.energies, body_errors.frequencies, body_errors.cuts]
)
@pytest.mark.filterwarnings("ignore::tca_cosim.FmuWarning")
def test_errors_are_within_their_bounds(rows: Callable[[], Iterator[body_errors.Row]]) -> None:
    actual = list(rows())
    assert len(actual) >= 2
    assert [row for row in actual if not row.value < row.bound] == []


def test_frequencies_tend_to_those_of_slender_beams() -> None:
    errors = [row.value for row in body_errors.frequencies()]
    for k in range(0, len(errors), 3):
        assert errors[k] > 10.0 * errors[k + 1] > 100.0 * errors[k + 2]  # as the square of the slenderness


def test_the_page_has_every_row() -> None:
    page = body_errors.PAGE.read_text(encoding="utf-8")
    for row in [*body_errors.equilibria(), *body_errors.cuts()]:
        assert f"| {row.what} |" in page
    assert body_errors.written(page, []) != page


@pytest.mark.filterwarnings("ignore::tca_cosim.FmuWarning")
def test_a_wrong_number_is_beyond_its_bound(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> None:
    """A polynomial of order 1 does not reach the bounds under weight, and the tool says so."""
    for kind in ("energies", "frequencies", "cuts"):
        monkeypatch.setattr(body_errors, kind, lambda: [])
    exact = body_errors.equilibria
    monkeypatch.setattr(body_errors, "equilibria", lambda: exact(1))
    monkeypatch.setattr("sys.argv", ["body_errors.py"])
    assert body_errors.main() == 1
    assert "BEYOND" in capsys.readouterr().out
