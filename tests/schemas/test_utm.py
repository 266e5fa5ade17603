"""UTM against a place that is known, and against itself."""

import math

import pytest

from schemas.problem import BadInput
from schemas.utm import utm_origin, zone_in, zone_of_epsg


def test_the_cn_tower() -> None:
    """43°38′33.24″N 79°23′13.7″W is zone 17, 630,084 m east, 4,833,438 m north."""
    found = utm_origin("17N", (630_084.0, 4_833_438.0, 76.0))
    assert found.latitude_deg == pytest.approx(43 + 38 / 60 + 33.24 / 3600, abs=1.5e-5)
    assert found.longitude_deg == pytest.approx(-(79 + 23 / 60 + 13.7 / 3600), abs=1.5e-5)
    assert found.altitude_m == 76.0


def test_the_middle_meridian_and_the_equator() -> None:
    found = utm_origin("31N", (500_000.0, 0.0, 0.0))
    assert (found.latitude_deg, found.longitude_deg) == pytest.approx((0.0, 3.0), abs=1e-12)
    assert found.heading_deg == pytest.approx(0.0, abs=1e-12)
    assert found.grid_scale == pytest.approx(0.9996, abs=1e-9)
    north, south = utm_origin("56N", (340_000.0, 3_000_000.0, 0.0)), utm_origin("56S", (340_000.0, 7e6, 0.0))
    assert south.latitude_deg == pytest.approx(-north.latitude_deg, abs=1e-12)
    assert south.longitude_deg == pytest.approx(north.longitude_deg, abs=1e-12)
    assert south.heading_deg == pytest.approx(-north.heading_deg, abs=1e-12)


@pytest.mark.parametrize("zone", ["32N", "56S"])
@pytest.mark.parametrize("east_m", [180_000.0, 500_000.0, 780_000.0])
@pytest.mark.parametrize("north_m", [4_200_000.0, 5_800_000.0])
def test_places_about_an_origin_are_those_of_the_grid(zone: str, east_m: float, north_m: float) -> None:
    """What lies 100 m off by the grid's axes is where the grid has it, to 3 mm: turn and scale are right."""
    origin = utm_origin(zone, (east_m, north_m, 10.0))
    for aside_m, ahead_m in ((100.0, 0.0), (0.0, 100.0), (-70.0, 60.0)):
        there = utm_origin(zone, (east_m + aside_m, north_m + ahead_m, 10.0))
        latitude, longitude, _ = origin.to_geographic((aside_m, ahead_m, 0.0))
        assert abs(latitude - there.latitude_deg) * 111_000 < 0.003
        off_deg = abs(longitude - there.longitude_deg)
        assert off_deg * 111_320 * math.cos(math.radians(latitude)) < 0.003
        back = origin.to_enu(latitude, longitude, 10.0)
        assert back == pytest.approx((aside_m, ahead_m, 0.0), abs=1e-6)


def test_a_place_of_no_zone() -> None:
    with pytest.raises(BadInput, match="is no place of a UTM zone"):
        utm_origin("32N", (0.0, 0.0, 0.0))


def test_zones_as_files_state_them() -> None:
    assert zone_in('PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84"]]') == "32N"
    assert zone_in('PROJCS["WGS_1984_UTM_Zone_17S",GEOGCS["GCS_WGS_1984"]]') == "17S"
    assert zone_in('PROJCS["NAD_1983_HARN_Lambert_Conformal_Conic"]') is None
    assert [zone_of_epsg(code) for code in (32632, 32756, 25833, 26917, 32661, 2193)] == [
        "32N", "56S", "33N", "17N", None, None,
    ]  # fmt: skip
    state_planes, others = (26929, 26943, 26960), (26924, 25827, 25839, 32600)
    assert [zone_of_epsg(code) for code in (*state_planes, *others)] == [None] * 7
    assert [zone_of_epsg(code) for code in (26901, 26923, 25828, 25838)] == [
        "1N", "23N", "28N", "38N",
    ]  # fmt: skip
