"""Where on the Earth a structure lies whose scans have large coordinates."""

import pytest

from schemas.contract import Vector3
from schemas.file import File
from schemas.geodesy import GeoOrigin, KnownPoint
from schemas.problem import BadInput
from schemas.structure import Structure
from schemas.utm import utm_origin

SHIFT: Vector3 = (691_600.0, 5_334_800.0, 0.0)
NOWHERE = File(sha256="0" * 64, size=0, suffix=".ply")
LOCAL = GeoOrigin(latitude_deg=48.1, longitude_deg=11.5, altitude_m=500.0)


def structure(shift_m: Vector3 = SHIFT) -> Structure:
    low, high = (-30.0, -10.0, 0.0), (30.0, 10.0, 12.0)
    return Structure(
        surfaces=(), obstacles=(), occupied=NOWHERE, min_m=low, max_m=high, world_origin_m=shift_m
    )


def known(model_m: Vector3, stated_m: Vector3) -> KnownPoint:
    latitude, longitude, altitude = LOCAL.to_geographic(model_m)
    return KnownPoint(model_m=stated_m, latitude_deg=latitude, longitude_deg=longitude, altitude_m=altitude)


@pytest.mark.parametrize("shift_m", [(0.0, 0.0, 0.0), SHIFT])
def test_known_points_are_taken_as_the_scans_have_them(shift_m: Vector3) -> None:
    ends: list[Vector3] = [(-28.0, 4.0, 1.0), (27.0, -6.0, 9.0)]
    stated = [(x + shift_m[0], y + shift_m[1], z + shift_m[2]) for x, y, z in ends]
    of_scans = [known(m, s) for m, s in zip(ends, stated, strict=True)]
    of_model = [known(m, m) for m in ends]
    for points in (of_scans, of_model):
        found = structure(shift_m).anchored(points)
        assert found.to_geographic((0.0, 0.0, 0.0)) == pytest.approx(LOCAL.to_geographic((0, 0, 0)), abs=1e-7)


def test_a_known_point_far_from_the_model_is_told() -> None:
    far = [known((0.0, 0.0, 0.0), (4_000.0, 9_000.0, 0.0)), known((20.0, 0.0, 0.0), (4_020.0, 9_000.0, 0.0))]
    with pytest.raises(BadInput, match=r"anchors: .*lies 10 km from the model"):
        structure().anchored(far)


def test_an_origin_far_away_places_no_mission() -> None:
    assert structure((0.0, 0.0, 0.0)).origin_as_stated(LOCAL) == LOCAL
    with pytest.raises(BadInput, match=r"5,379 km from it"):
        structure().origin_as_stated(LOCAL)


def test_a_map_grid_places_it() -> None:
    assert structure().geo_origin("32N") == utm_origin("32N", SHIFT)
    assert structure().geo_origin() is None
