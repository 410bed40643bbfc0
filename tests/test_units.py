"""Units: quantities as texts, by factor and offset of the FMU's own definition."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tca_cosim.fmi.units import convert

KELVIN, RADIAN = {"K": 1}, {"rad": 1}
FAHRENHEIT = (5.0 / 9.0, 459.67 * 5.0 / 9.0)  # factor and offset in K


@pytest.mark.parametrize(
    ("text", "expected"),
    [("300 K", 80.33), ("26.85 degC", 80.33), ("80.33 degF", 80.33), ("80.33", 80.33), ("-40 degC", -40.0)],
)
def test_an_offset_is_taken_before_the_factor(text: str, expected: float) -> None:
    """A variable in degF whose definition is K = 5/9 (F + 459.67)."""
    assert convert(text, KELVIN, "degF", False, *FAHRENHEIT) == pytest.approx(expected, abs=1e-9)


def test_differences_have_no_offset() -> None:
    assert convert("5 K", KELVIN, "degF", True, *FAHRENHEIT) == pytest.approx(9.0)
    assert convert("5 degC", KELVIN, "K", True) == pytest.approx(5.0)
    assert convert("5 degC", KELVIN, "K") == pytest.approx(278.15)


def test_radians_count_as_a_dimension() -> None:
    assert convert("180 deg", RADIAN, "rad") == pytest.approx(3.141592653589793)
    assert convert("60 rpm", {"rad": 1, "s": -1}, "rad/s") == pytest.approx(2 * 3.141592653589793)
    with pytest.raises(ValueError, match="does not fit"):
        convert("1 Hz", {"rad": 1, "s": -1}, "rad/s")
    with pytest.raises(ValueError, match="does not fit"):
        convert("1 rad", {}, "1")


def test_a_unit_without_definition_counts_by_its_name() -> None:
    assert convert("40 mm", None, "m") == pytest.approx(0.04)
    assert convert("3 widgets", None, "widgets") == 3.0
    with pytest.raises(ValueError, match="unit 'widgets' is not known"):
        convert("3 m", None, "widgets")


def test_what_is_no_quantity_is_refused() -> None:
    for text in ("", "V", "3 4 V", "1,5 V", "3 furlongs per what", "3 V\nW", "nan V"):
        with pytest.raises(ValueError, match="not"):
            convert(text, {"kg": 1, "m": 2, "s": -3, "A": -1}, "V")


@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e3), st.floats(-500.0, 500.0))
def test_a_text_in_kelvin_comes_back(value: float, factor: float, offset: float) -> None:
    """factor * convert(x) + offset is x again."""
    number = convert(f"{value!r} K", KELVIN, "own", False, factor, offset)
    assert factor * number + offset == pytest.approx(value, rel=1e-9, abs=1e-9)
