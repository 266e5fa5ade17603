"""A crack's own figures."""

import pytest

from schemas.crack import Crack


@pytest.mark.parametrize(
    ("line", "middle"),
    [
        (((10.0, 50.0), (500.0, 50.0)), (255.0, 50.0)),
        (((0.0, 0.0), (3.0, 4.0), (3.0, 19.0)), (3.0, 9.0)),
        (((7.0, 8.0),), (7.0, 8.0)),
        (((7.0, 8.0), (7.0, 8.0)), (7.0, 8.0)),
    ],
)
def test_the_middle_lies_half_way_along(
    line: tuple[tuple[float, float], ...], middle: tuple[float, float]
) -> None:
    crack = Crack(
        id="C001",
        surface="s",
        polyline_px=line,
        length_px=1.0,
        width_median_px=1.0,
        width_max_px=1.0,
        orientation_deg=0.0,
    )
    assert crack.middle_px == pytest.approx(middle)
