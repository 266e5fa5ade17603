"""Photos judged while they arrive, against a plan whose points lie 0.6 m apart."""

import hashlib

import numpy as np
import pytest

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.file import File
from schemas.flight_plan import Waypoint
from schemas.photo import Photo
from tasks.photos.arrival import judged, missing
from tests.flight.wall_plan import wall_plan

PLAN = wall_plan()
POINTS = PLAN.shooting_points
CAMERA = Camera(width_px=400, height_px=300, focal_px=900.0)


def photo(
    name: str, sharpness: float = 0.2, content: str | None = None, white: float = 0.0, black: float = 0.0
) -> Photo:
    sha = hashlib.sha256((content or name).encode()).hexdigest()
    return Photo(
        name=name, file=File(sha256=sha, size=1, suffix=".jpg"), camera=CAMERA, surface="watched",
        sharpness=sharpness, exposure=0.5, white=white, black=black,
    )  # fmt: skip


def shot_at(name: str, point: Waypoint, off_m: Vector3 = (0, 0, 0), yaw_deg: float | None = None) -> Photo:
    east, north, up = (a + b for a, b in zip(point.position_m, off_m, strict=True))
    latitude, longitude, _ = PLAN.origin.to_geographic((east, north, up))
    yaw = point.yaw_deg if yaw_deg is None else yaw_deg
    return photo(name).model_copy(
        update={
            "gps": (latitude, longitude, up - PLAN.home_m[2]),
            "view_deg": (yaw, point.pitch_deg, 0.0),
        }
    )


def test_good_photos_have_no_faults() -> None:
    assert [a.faults for a in judged([photo("a"), photo("b"), photo("c", 0.17), photo("d", 0.24)], None)] == [
        ()
    ] * 4


def test_blur_duplicates_and_exposure_are_told() -> None:
    photos = [photo("a"), photo("b"), photo("c"), photo("d", 0.04), photo("e", content="a")]
    photos += [photo("f", white=0.7), photo("g", 0.0, black=0.95)]
    faults = [" ".join(a.faults) for a in judged(photos, None)]
    assert faults[:3] == [""] * 3
    assert faults[3].startswith("blurred (sharpness 20% of")
    assert faults[4] == "the same picture as a"
    assert faults[5] == "overexposed (70% of it is white)"
    assert faults[6] == "underexposed (95% of it is black)"


def test_the_plans_names_place_photos() -> None:
    arrivals = judged([photo(f"{w.photo}.jpg") for w in POINTS[:3]], PLAN)
    assert [a.point for a in arrivals] == [w.photo for w in POINTS[:3]]
    assert missing(arrivals, PLAN) == tuple(w.photo for w in POINTS[3:])


@pytest.mark.parametrize("seed", range(5))
def test_gps_places_photos_and_tells_which_point_was_missed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lost = int(rng.integers(len(POINTS)))
    photos = [
        shot_at(f"DJI_{k:04d}.JPG", w, tuple(rng.normal(0, 0.12, 3)), w.yaw_deg + rng.normal(0, 3))
        for k, w in enumerate(POINTS)
        if k != lost
    ]
    arrivals = judged(photos, PLAN)
    assert [a.faults for a in arrivals] == [()] * len(photos)
    assert missing(arrivals, PLAN) == (POINTS[lost].photo,)
    assert [a.point for a in arrivals] == [w.photo for k, w in enumerate(POINTS) if k != lost]


def test_a_photo_of_another_place_or_direction_is_of_no_point() -> None:
    far = shot_at("far.jpg", POINTS[0], (-9.0, 0.0, 0.0))
    turned = shot_at("turned.jpg", POINTS[0], yaw_deg=95.0)
    again = shot_at("again.jpg", POINTS[0], (0.1, 0.0, 0.0))
    arrivals = judged([*(shot_at(f"{w.photo}-x.jpg", w) for w in POINTS), far, turned, again], PLAN)
    by_name = {a.name: a for a in arrivals}
    assert by_name["far.jpg"].faults[0].startswith("wrong place: 9.0 m from ")
    assert "turned by 95°" in by_name["turned.jpg"].faults[0]
    assert by_name["again.jpg"].faults == ()
    assert by_name["again.jpg"].point is None or "one more" in " ".join(a.note for a in arrivals)
    assert missing(arrivals, PLAN) == ()


def test_a_blurred_photo_leaves_its_point_open() -> None:
    photos = [photo(f"{w.photo}.jpg", 0.02 if k == 2 else 0.2) for k, w in enumerate(POINTS)]
    assert missing(judged(photos, PLAN), PLAN) == (POINTS[2].photo,)


def test_without_name_and_gps_order_counts() -> None:
    arrivals = judged([photo("IMG_1.jpg"), photo("IMG_2.jpg", 0.2)], PLAN)
    assert [a.point for a in arrivals] == [POINTS[0].photo, POINTS[1].photo]
    assert "by order" in arrivals[0].note
