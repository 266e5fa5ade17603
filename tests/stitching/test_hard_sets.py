"""Sets that do not add up: a horizon, a weak chain, a picture twice, a photo that loses its last point, a
scan that measured a hedge. Nothing may crash, and what is good must stay."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from schemas.camera import Camera, CameraPose
from schemas.file import File
from schemas.photo import Photo
from schemas.settings import StitchSettings
from tasks.stitching import mosaicking
from tasks.stitching.adjustment import adjust
from tasks.stitching.mosaicking import Registered, register_photos
from tasks.stitching.pairs import PhotoFeatures
from tasks.stitching.prior import PlaneFrame, Prior
from tasks.stitching.relief import HeightMap
from tasks.stitching.solution import Solved, neighbours, solve
from tasks.stitching.tracks import Observations
from tasks.stitching.view import FACING, View, rotation
from tests.stitching.test_adjustment import CAMERA, flown, observed
from tests.stitching.test_on_relief import waves
from tests.stitching.test_own_relief import rough

Array = npt.NDArray[np.float64]
PLAIN = CAMERA.model_copy(update={"k1": 0.0})


def looks(count: int) -> npt.NDArray[np.uint8]:
    """(count, 128) of points that all look different."""
    drawn = np.random.default_rng(0).exponential(size=(count, 128))
    return np.asarray(np.rint(512 * np.sqrt(drawn / drawn.sum(axis=1, keepdims=True))), np.uint8)


def features(px: Array, camera: Camera, look: npt.NDArray[np.uint8]) -> PhotoFeatures:
    """Of those of (N, 2) pixels that lie in the photo."""
    seen = ((px > 0) & (px < [camera.width_px - 1, camera.height_px - 1])).all(axis=1)
    none = np.zeros(seen.sum(), np.float32)
    return PhotoFeatures(px[seen].astype(np.float32), none + np.float32(1.0), none, look[seen])


def without_positions(views: Sequence[View]) -> PlaneFrame:
    tilt = np.radians([8.0, 8.0, np.inf])
    facing = [View(v.camera, FACING, np.array([0.0, 0.0, 1.0])) for v in views]
    return PlaneFrame(None, "none", tuple(Prior(v, np.full(3, np.inf), tilt) for v in facing), np.zeros(3))


def with_positions(views: Sequence[View]) -> PlaneFrame:
    rng = np.random.default_rng(3)
    near = [replace(v, C=v.C + rng.normal(0, 0.05, 3), relief=None) for v in views]
    priors = tuple(Prior(v, np.full(3, 0.05), np.radians(np.full(3, 2.0))) for v in near)
    return PlaneFrame(None, "poses", priors, np.full(3, 0.05))


def solved(given: list[PhotoFeatures], frame: PlaneFrame, relief: HeightMap | None = None) -> Solved:
    pairs = neighbours(given, frame)
    return solve(given, frame, [0.01] * len(given), pairs, 3.0, lambda _: None, relief)


def shown(views: Sequence[View], uv: Array) -> list[PhotoFeatures]:
    rng, look = np.random.default_rng(1), looks(len(uv))
    return [features(view.to_photo(uv) + rng.normal(0, 0.3, uv.shape), view.camera, look) for view in views]


WIDE = Camera(width_px=1600, height_px=1200, focal_px=1300.0)
GROUND = np.random.default_rng(7).uniform([-20, -20, 0], [40, 60, 0], (9000, 3))


def over_ground(rng: np.random.Generator) -> list[tuple[float, float, float]]:
    """Twelve shots: metres east and north, pitch in degrees."""
    return [
        (6.0 * (k % 4) + rng.normal(0, 0.3), 5.0 * (k // 4) + rng.normal(0, 0.3), -90.0 + rng.normal())
        for k in range(12)
    ]


def by_gps(
    shots: Sequence[tuple[float, float, float]], places: Array, rng: np.random.Generator
) -> tuple[list[Photo], list[PhotoFeatures]]:
    """Photos from 20 m, as their headers tell: half a metre off."""
    photos, given, look = [], [], looks(len(places))
    for k, (x, y, pitch) in enumerate(shots):
        pose = CameraPose(position_m=(x, y, 20.0), yaw_deg=0.0, pitch_deg=pitch)
        given.append(features(WIDE.project(places, pose) + rng.normal(0, 0.3, (len(places), 2)), WIDE, look))
        north, east = y + rng.normal(0, 0.5), x + rng.normal(0, 0.5)
        at = (
            48 + np.degrees(north / 6371000),
            11 + np.degrees(east / 6371000 / np.cos(np.radians(48))),
            20.0,
        )
        photos.append(
            Photo(
                name=f"p{k:02d}.jpg",
                file=File(sha256=f"{k:064x}", size=10, suffix=".jpg"),
                camera=WIDE,
                position_sigma_m=1.0,
                gps=at,
                view_deg=(0.0, pitch, 0.0),
                surface="s",
                sharpness=1.0,
                exposure=0.5,
            )
        )
    return photos, given


def registered(photos: list[Photo], given: list[PhotoFeatures]) -> Registered:
    return register_photos("s", None, photos, given, StitchSettings(), lambda _: None)


@pytest.mark.parametrize("pitch_deg", [-15.0, -20.0])
def test_photos_of_the_horizon_leave_the_others_alone(pitch_deg: float) -> None:
    """Twelve photos of the ground by GPS, and two into the distance, 30 cm apart."""
    rng = np.random.default_rng(0)
    hills = np.column_stack([rng.uniform(-400, 400, 3000), np.full(3000, 500.0), rng.uniform(0, 150, 3000)])
    shots = [*over_ground(rng), (8.0, -5.0, pitch_deg), (8.3, -5.0, pitch_deg)]
    found = registered(*by_gps(shots, rng.permutation(np.concatenate([GROUND, hills])), rng))
    assert [fate.status for fate in found.fates[:12]] == ["solved"] * 12
    assert "solved" not in [fate.status for fate in found.fates[12:]]


@pytest.mark.parametrize("away_deg", [0.003, 0.05, 30.0])
def test_a_photo_that_bears_a_strange_position_is_matched_by_its_picture(away_deg: float) -> None:
    rng = np.random.default_rng(1)
    photos, given = by_gps(over_ground(rng), GROUND, rng)
    latitude, longitude, height = photos[5].gps or (0.0, 0.0, 0.0)
    photos[5] = photos[5].model_copy(update={"gps": (latitude - away_deg, longitude, height)})
    found = registered(photos, given)
    assert [fate.status for fate in found.fates] == ["solved"] * 12
    assert found.solved.sigma_scale < 0.1
    (word,) = found.left_out
    assert word.item == "p05.jpg"
    assert "was not used" in word.what


def test_positions_that_lead_to_nothing_are_done_without(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where two photos of a set have one, and both come loose; that the scale is lost is said."""

    def solve_without_positions(given: list[PhotoFeatures], frame: PlaneFrame, *known: Any) -> Solved:
        return solve(given, frame, *known) if frame.scale_from == "none" else nothing

    nothing = Solved({}, {}, {}, {}, 0.0, 0.0, (), frozenset())
    monkeypatch.setattr(mosaicking, "solve", solve_without_positions)
    rng = np.random.default_rng(2)
    found = registered(*by_gps(over_ground(rng), GROUND, rng))
    assert [fate.status for fate in found.fates] == ["solved"] * 12
    assert found.scale_from == "none"
    assert ["scale is not known" in word.what for word in found.left_out] == [True]


def test_a_weak_chain_that_comes_loose_link_by_link_leaves_the_others() -> None:
    """Six photos in a row, each tied to the last by 14 matches of which four are false by 8 px."""
    camera = Camera(width_px=5472, height_px=3648, focal_px=5472 * 1.2)
    rng, links = np.random.default_rng(0), 14
    wide, high = 4.0 / 1.2, 4.0 / 1.2 * 3648 / 5472
    true = [
        View(
            camera,
            FACING @ rotation(np.radians(rng.normal(0, 1.5, 3))),
            np.array([0.4 * wide * (k % 4), 0.5 * high * (k // 4), 4.0]) + rng.normal(0, 0.05, 3),
        )
        for k in range(12)
    ]
    for k in range(6):
        turn = rotation(np.radians(rng.normal(0, 1, 3)))
        true.append(View(camera, FACING @ turn, true[3].C * [1, 1, 0] + [0.55 * wide * (k + 1), 0, 4.0]))
    uv, shows = [rng.uniform((-wide, -high), (2.3 * wide, 2 * high), (4000, 2))], [np.arange(18) < 12] * 4000
    chain = [3, *range(12, 18)]
    for a, b in pairwise(chain):
        middle = (true[a].C[:2] + true[b].C[:2]) / 2
        uv.append(middle + rng.uniform(-1, 1, (links, 2)) * [0.12 * wide, 0.35 * high])
        shows += [np.isin(np.arange(18), (a, b))] * links
    places, look = np.concatenate(uv), looks(4000 + 6 * links)
    link = np.arange(len(places)) - 4000
    false = (link >= 0) & (link % links >= links - 4)
    way = np.random.default_rng(77).uniform(0, 2 * np.pi, len(places))
    away = np.column_stack([np.cos(way), np.sin(way)]) * np.random.default_rng(78).uniform(
        3.6, 4.4, (len(way), 1)
    )
    given = []
    for k, view in enumerate(true):
        px = view.to_photo(places) + rng.normal(0, 0.3, places.shape)
        side = np.where(k - 12 == link // links, 1.0, -1.0)
        px = px + (false * side)[:, None] * away
        given.append(features(np.where(np.array(shows)[:, k, None], px, -1.0), camera, look))
    assert set(range(12)) <= set(solved(given, with_positions(true)).views)


def test_a_picture_that_is_there_twice_crashes_nothing() -> None:
    """Its points are seen from one place only: nothing tells how high they stand."""
    rng = np.random.default_rng(5)
    true = [
        View(
            PLAIN,
            FACING @ rotation(np.radians(rng.normal(0, 1.5, 3))),
            np.array([1.3 * (k % 3), 1.0 * (k // 3), 4.0]) + rng.normal(0, 0.05, 3),
            relief=waves(3),
        )
        for k in range(6)
    ]
    given = shown(true, rng.uniform((-2.5, -2.2), (7, 4.3), (9000, 2)))
    found = solved([*given, given[0]], without_positions([*true, true[0]]))
    assert sorted(found.views) == list(range(7))
    assert all(np.isfinite(two).all() for two in found.covariance.values())


def test_two_photos_state_no_uncertainty_among_themselves() -> None:
    """A similarity takes up all that the two middles err by: it would be 0.00 mm."""
    true = [View(PLAIN, FACING, np.array([x, 0.5, 4.0]), relief=waves(3)) for x in (0.5, 1.8)]
    places = np.random.default_rng(5).uniform((-2.5, -2.2), (5.0, 3.0), (4000, 2))
    found = solved(shown(true, places), with_positions(true))
    assert sorted(found.views) == [0, 1]
    assert found.covariance == {}


def test_a_photo_that_loses_its_last_point_crashes_nothing() -> None:
    """Forty false matches hold it, and nothing tells how far away it was."""
    true = flown(20, 0.0)
    said, seen, priors = observed(true, 0.3, 20)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        track = rng.choice(seen.tracks, 40, replace=False)
        order = np.argsort(np.concatenate([seen.track, track]), kind="stable")
        more = Observations(
            np.concatenate([seen.photo, np.full(40, 12)])[order],
            np.concatenate([seen.track, track])[order],
            np.concatenate([seen.xy, rng.uniform([0, 0], [1599, 1199], (40, 2))])[order],
        )
        strange = View(PLAIN, FACING, np.array([1.9, 1.0, 4.0]))
        unsure = [Prior(p.view, np.array([0.05, 0.05, np.inf]), p.sigma_rotation) for p in priors]
        last = Prior(strange, np.array([0.05, 0.05, np.inf]), priors[0].sigma_rotation)
        found = adjust([*said, strange], more, [*unsure, last], np.full(3, 0.05), [0.01] * 13, lambda _: None)
        assert (found.observations.photo == 12).sum() < 12
        assert np.isfinite([view.C for view in found.views]).all()


def test_a_relief_on_which_a_photo_comes_loose_is_not_taken() -> None:
    """Right over most of the wall; at one end the scan measured a hedge, 30 cm up and down."""
    right = rough(3.0)
    u = right.left + right.cell * np.arange(right.w.shape[1])
    hedge = np.where(u > 3.4, np.random.default_rng(2).normal(0, 0.3, right.w.shape), 0.0)
    true = [replace(view, camera=PLAIN, relief=right) for view in flown(20, 0.0)]
    true.append(View(PLAIN, FACING, np.array([true[3].C[0] + 1.0, true[3].C[1], 4.0]), relief=right))
    given = shown(true, np.random.default_rng(3).uniform((-1.5, -1.2), (5.5, 3.3), (7000, 2)))
    wrong = replace(right, w=right.w + hedge)
    found = solved(given, with_positions(true), wrong)
    assert found.relief is not wrong
    assert found.matches[12] > 150
