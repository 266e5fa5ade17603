"""Figures carry the digits that their uncertainty warrants, and no more."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from artifacts.precision import area_m2, millimetres, number


@pytest.mark.parametrize(
    ("value_mm", "sigma_mm", "shown"),
    [
        (1.27, 0.11, "1.3 ± 0.1"),
        (1.27, 0.48, "1.3 ± 0.5"),
        (0.153, 0.021, "0.15 ± 0.02"),
        (0.3, 0.0004, "0.30 ± 0.01"),
        (1234.4, 34.0, "1230 ± 30"),
        (1234.4, 12.0, "1234 ± 12"),
        (99.96, 3.0, "100 ± 3"),
        (1.27, None, "1.3"),
        (None, None, "–"),
    ],
)
def test_examples(value_mm: float | None, sigma_mm: float | None, shown: str) -> None:
    assert millimetres(value_mm, sigma_mm) == shown


def test_a_bound_is_shown_as_one() -> None:
    """Rounded up: 0.4 would be less than what was measured."""
    assert millimetres(0.42, 0.2, at_most=True) == "≤ 0.5"
    assert millimetres(0.4, 0.2, at_most=True) == "≤ 0.4"
    assert millimetres(0.24, at_most=True) == "≤ 0.3"


@given(st.floats(0.0, 1e5), st.floats(1e-3, 1e4))
def test_rounding_stays_within_the_uncertainty(value_mm: float, sigma_mm: float) -> None:
    shown, shown_sigma = (float(part) for part in millimetres(value_mm, sigma_mm).split(" ± "))
    assert abs(shown - value_mm) <= max(0.5 * sigma_mm, 0.005) + 1e-9
    assert shown_sigma > 0
    assert shown_sigma == pytest.approx(sigma_mm, rel=0.5) or shown_sigma == 0.01


def test_signs_and_unknowns() -> None:
    assert number(-0.001, 2) == "0.00"
    assert number(-1.5) == "−1.5"
    assert number(None) == area_m2(None) == "–"
    assert [area_m2(v) for v in (1.234, 12.34, 123.4)] == ["1.23", "12.3", "123"]
