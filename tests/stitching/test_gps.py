"""Photos without poses: what GPS, heights over the take-off and gimbals tell of a mosaic's scale."""

import numpy as np
import pytest

from schemas.geodesy import GeoOrigin
from schemas.mosaic import Mosaic
from tests.stitching.photo_sets import SETTINGS, PhotoSet, errors_px


def status(mosaic: Mosaic) -> dict[str, str]:
    return {p.name: p.status for p in mosaic.placements}


def located(wall: PhotoSet, sigma_m: float) -> PhotoSet:
    """As a drone's photos before the wall say it: GPS, height above take-off, gimbal; no poses."""
    origin, rng = GeoOrigin(latitude_deg=48.0, longitude_deg=11.0), np.random.default_rng(6)
    photos = []
    for photo in wall.photos:
        _, pose = wall.truth[photo.name]
        east, north, up = np.asarray(pose.position_m) + rng.normal(0, sigma_m, 3)
        latitude, longitude, _ = origin.to_geographic((east, north, up))
        photos.append(
            photo.model_copy(
                update={
                    "pose": None,
                    "gps": (latitude, longitude, up + 10.0),
                    "view_deg": (pose.yaw_deg, pose.pitch_deg, 0.0),
                    "position_sigma_m": sigma_m,
                }
            )
        )
    return PhotoSet(tuple(photos), wall.features, wall.truth)


def over_a_deck(wall: PhotoSet, sigma_m: float, deck_m: float) -> PhotoSet:
    """The wall laid flat, so high over the take-off: photographed from above, 4 m over it."""
    origin, rng = GeoOrigin(latitude_deg=48.0, longitude_deg=11.0), np.random.default_rng(6)
    photos = []
    for photo in wall.photos:
        _, pose = wall.truth[photo.name]
        x, y, z = pose.position_m
        east, north, up = np.array([x, z, -y]) + rng.normal(0, sigma_m, 3)
        latitude, longitude, _ = origin.to_geographic((east, north, 0.0))
        said = {"gps": (latitude, longitude, up + deck_m), "view_deg": (0.0, -90.0, 0.0)}
        photos.append(photo.model_copy(update={"pose": None, "position_sigma_m": sigma_m} | said))
    return PhotoSet(tuple(photos), wall.features, wall.truth)


@pytest.mark.parametrize("deck_m", [0.0, 3.0, -2.0])
def test_a_decks_height_over_the_take_off_is_not_taken_for_its_distance(
    wall: PhotoSet, deck_m: float
) -> None:
    """Distances between positions, 0.1 m each over 3 m, tell the scale to some per cent."""
    mosaic = over_a_deck(wall, 0.1, deck_m).stitch(None)
    assert {p.status: p.reason for p in mosaic.placements} == {"solved": ""}
    assert mosaic.scale_from == "GPS"
    assert mosaic.scale_sigma is not None
    assert 0.01 < mosaic.scale_sigma < 0.06
    assert mosaic.gsd_mm_px == pytest.approx(2.0, rel=3 * mosaic.scale_sigma)


def test_positions_that_tell_nothing_leave_the_scale_as_unsure_as_the_take_off(wall: PhotoSet) -> None:
    mosaic = over_a_deck(wall, 5.0, 3.0).stitch(None)
    assert mosaic.scale_sigma is not None
    assert 0.3 < mosaic.scale_sigma < 1.0
    assert mosaic.gsd_mm_px == pytest.approx(2.0, rel=2 * mosaic.scale_sigma)


def without_view(photos: PhotoSet) -> PhotoSet:
    bare = tuple(p.model_copy(update={"view_deg": None}) for p in photos.photos)
    return PhotoSet(bare, photos.features, photos.truth)


def from_below(photos: PhotoSet) -> PhotoSet:
    """What is north is south: as positions below a deck lie, seen in the photos."""
    turned = []
    for photo in photos.photos:
        assert photo.gps is not None
        latitude, longitude, up = photo.gps
        turned.append(photo.model_copy(update={"gps": (96.0 - latitude, longitude, up)}))
    return PhotoSet(tuple(turned), photos.features, photos.truth)


def test_photos_that_look_down_need_not_say_so(wall: PhotoSet) -> None:
    mosaic = without_view(over_a_deck(wall, 0.1, 3.0)).stitch(None)
    assert set(status(mosaic).values()) == {"solved"}
    assert mosaic.scale_from == "GPS"
    assert mosaic.scale_sigma is not None
    assert mosaic.scale_sigma < 0.06
    assert mosaic.gsd_mm_px == pytest.approx(2.0, rel=3 * mosaic.scale_sigma)


@pytest.mark.parametrize("sigma_m", [0.1, 5.0])
@pytest.mark.parametrize("where", ["before a wall", "below a deck"])
def test_photos_that_do_not_say_where_they_look_are_not_taken_to_look_down(
    wall: PhotoSet, where: str, sigma_m: float
) -> None:
    """Their positions lie on a line, or mirrored: no scale, but all else."""
    known = located(wall, 0.1) if where == "before a wall" else from_below(over_a_deck(wall, 0.1, -6.0))
    photos = tuple(p.model_copy(update={"position_sigma_m": sigma_m}) for p in known.photos)
    mosaic = without_view(PhotoSet(photos, wall.features, wall.truth)).stitch(None)
    assert set(status(mosaic).values()) == {"solved"}
    assert (mosaic.scale_from, mosaic.gsd_mm_px, mosaic.gauge) == ("none", None, "scale not known")
    assert np.sqrt(np.mean(errors_px(mosaic, wall.truth, gauge=True) ** 2)) < 0.15


def test_photos_of_a_wall_need_no_more_than_gps_and_gimbal(wall: PhotoSet) -> None:
    mosaic = located(wall, 0.1).stitch(None)
    assert set(status(mosaic).values()) == {"solved"}
    assert mosaic.scale_from == "GPS"
    assert mosaic.scale_sigma is not None
    assert 0.005 < mosaic.scale_sigma < 0.1
    assert mosaic.gsd_mm_px == pytest.approx(2.0, rel=3 * mosaic.scale_sigma)
    assert np.sqrt(np.mean(errors_px(mosaic, wall.truth, gauge=True) ** 2)) < 0.15


def test_gps_without_height_tells_no_place_on_a_wall(wall: PhotoSet) -> None:
    flat = tuple(
        p.model_copy(update={"gps": (p.gps[0], p.gps[1], 0.0)})
        for p in located(wall, 0.1).photos
        if p.gps is not None
    )
    mosaic = PhotoSet(flat, wall.features, wall.truth).stitch(None)
    assert set(status(mosaic).values()) == {"solved"}
    assert (mosaic.scale_from, mosaic.gsd_mm_px, mosaic.scale_sigma) == ("none", None, None)


def test_a_stated_scale_that_gps_contradicts_is_said_to_be_in_doubt(wall: PhotoSet) -> None:
    for gsd_mm_px, doubts in ((2.0, 0), (0.02, 1)):
        mosaic = located(wall, 0.1).stitch(None, SETTINGS.model_copy(update={"gsd_mm_px": gsd_mm_px}))
        assert (mosaic.scale_from, mosaic.gsd_mm_px) == ("stated GSD", pytest.approx(gsd_mm_px))
        assert len(mosaic.left_out) == doubts
    assert "0.02 mm/px by stated GSD, 2" in mosaic.left_out[0].what
