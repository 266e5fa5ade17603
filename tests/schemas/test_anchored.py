"""Origin and heading of a model from points whose place on the Earth is known."""

import math

import pytest

from schemas.contract import Vector3
from schemas.geodesy import GeoOrigin, KnownPoint, anchored
from schemas.problem import BadInput

TRUE = GeoOrigin(latitude_deg=47.3, longitude_deg=8.5, altitude_m=410.0, heading_deg=237.5)
ENDS: tuple[Vector3, ...] = ((12.0, -3.0, 1.5), (-70.0, 40.0, 9.0))


def known(model_m: Vector3, moved_m: Vector3 = (0.0, 0.0, 0.0), height: bool = True) -> KnownPoint:
    x, y, z = (a + b for a, b in zip(model_m, moved_m, strict=True))
    latitude, longitude, altitude = TRUE.to_geographic((x, y, z))
    return KnownPoint(
        model_m=model_m,
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=altitude if height else None,
    )


def test_the_y_axis_points_where_the_heading_says() -> None:
    east = GeoOrigin(latitude_deg=0.0, longitude_deg=0.0, heading_deg=90.0)
    latitude, longitude, _ = east.to_geographic((0.0, 100.0, 0.0))
    assert latitude == pytest.approx(0.0, abs=1e-9)
    assert longitude > 0.0008
    assert east.compass_deg(350.0) == pytest.approx(80.0)
    assert east.yaw_deg(80.0) == pytest.approx(350.0)


def test_a_turned_frame_and_back() -> None:
    place = (31.0, -64.0, 7.0)
    assert TRUE.to_enu(*TRUE.to_geographic(place)) == pytest.approx(place, abs=1e-6)


def test_two_points_give_origin_and_heading() -> None:
    found = anchored([known(m) for m in ENDS])
    assert found.heading_deg == pytest.approx(237.5, abs=1e-3)
    assert found.to_enu(*TRUE.to_geographic((5.0, 5.0, 5.0))) == pytest.approx((5.0, 5.0, 5.0), abs=0.005)
    assert found.residual_m == pytest.approx(0.0, abs=0.005)


def test_heights_are_not_needed() -> None:
    found = anchored([known(m, height=False) for m in ENDS])
    assert found.heading_deg == pytest.approx(237.5, abs=1e-3)
    assert found.altitude_m == 0.0


def test_what_is_left_between_the_points_is_said() -> None:
    along = tuple(0.4 * (a - b) / math.dist(*ENDS) for a, b in zip(*ENDS, strict=True))
    found = anchored([known(ENDS[0], along), known(ENDS[1])])  # 40 cm too far apart: 20 cm at either end
    assert found.residual_m == pytest.approx(0.2, abs=0.01)


def test_contradicting_points_are_refused() -> None:
    with pytest.raises(BadInput, match="contradict") as problem:
        anchored([known(ENDS[0], (6.0, 0.0, 0.0)), known(ENDS[1])])
    assert problem.value.item == "anchors"
    with pytest.raises(BadInput, match="contradict"):
        anchored([known(ENDS[0], (0.0, 0.0, 3.0)), known(ENDS[1])])


@pytest.mark.parametrize("points", [ENDS[:1], (ENDS[0], (12.5, -3.5, 2.0))])
def test_points_without_a_heading_are_refused(points: tuple[Vector3, ...]) -> None:
    with pytest.raises(BadInput, match="heading"):
        anchored([known(m) for m in points])
