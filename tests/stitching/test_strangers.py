"""Positions that cannot be right, and those that only look odd."""

import numpy as np
import numpy.typing as npt
import pytest

from schemas.camera import Camera, CameraPose
from schemas.file import File
from schemas.photo import Photo
from tasks.stitching.strangers import strangers

CAMERA = Camera(width_px=1600, height_px=1200, focal_px=1300.0)


def photos(at_m: npt.ArrayLike) -> list[Photo]:
    return [
        Photo(
            name=f"{k}.jpg",
            file=File(sha256=f"{k:064x}", size=10, suffix=".jpg"),
            camera=CAMERA,
            pose=CameraPose(position_m=(float(x), float(y), float(z)), yaw_deg=0.0, pitch_deg=0.0),
            position_sigma_m=1.0,
            surface="s",
            sharpness=1.0,
            exposure=0.5,
        )
        for k, (x, y, z) in enumerate(np.asarray(at_m))
    ]


ROW = np.column_stack([5.0 * np.arange(20), np.zeros((20, 2))])


@pytest.mark.parametrize(("x", "away"), [(195.0, 100.0), (5000.0, 4905.0), (-4.1e6, 4.1e6)])
def test_a_position_far_from_all_others_is_strange(x: float, away: float) -> None:
    found = strangers(photos([*ROW, (x, 0.0, 0.0)]))
    assert found == {20: pytest.approx(away)}


def test_far_is_more_than_the_others_are_spread_or_many_times_their_distances() -> None:
    long = np.column_stack([5.0 * np.arange(200), np.zeros((200, 2))])
    assert strangers(photos([*long, (1095.0, 0.0, 0.0)])) == {200: pytest.approx(100.0)}
    sparse = 8.0 * ROW[:6]
    assert strangers(photos([*sparse, (500.0, 0.0, 0.0)])) == {6: pytest.approx(300.0)}


def test_a_burst_at_a_strange_place_is_strange_and_one_at_each_station_is_not() -> None:
    """Then most photos lie at no distance from their nearest."""
    stations = np.repeat(8.0 * ROW[:6], 3, axis=0) + np.random.default_rng(1).normal(0, 0.3, (18, 3))
    assert strangers(photos([*stations, (240.0, 5.0, 0.0)])) == {}
    lost = np.repeat([[9000.0, 0.0, 0.0]], 3, axis=0)
    assert strangers(photos([*stations, *lost])) == dict.fromkeys(
        (18, 19, 20), pytest.approx(8800.0, abs=1.0)
    )


def test_a_second_wall_a_last_shot_on_the_way_home_and_bursts_are_not() -> None:
    second = ROW + np.array([0.0, 800.0, 0.0])
    for at in (
        ROW,
        [*ROW, *second],
        [*ROW, (110.0, 8.0, 2.0)],
        np.repeat(8.0 * ROW, 3, axis=0),
        ROW[:4] * 50,
    ):
        assert strangers(photos(at)) == {}
