import numpy as np
import pytest

from tasks.flight.legs import distances_m, legs_between, legs_of, mission_corners
from tests.flight.wall_plan import wall_plan


def test_distance_from_a_leg_and_beyond_its_ends() -> None:
    corners = np.array([[0.0, 0, 0], [10, 0, 0], [10, 0, 0]])
    points = np.array([[5.0, 3, 4], [13, 4, 0], [-3, 0, 4]])
    assert distances_m(points, corners) == pytest.approx(
        np.array([[5, np.hypot(5, 5)], [5, 5], [5, np.hypot(13, 4)]])
    )


def test_a_path_back_along_itself_is_told_apart_by_order() -> None:
    corners = np.array([[0.0, 0, 0], [10, 0, 0], [0, 0, 0], [0, 10, 0]])
    out = np.linspace([0, 0, 0], [10, 0, 0], 50)
    aside = np.linspace([0, 0.3, 0], [0, 10, 0], 20)
    leg = legs_of(np.vstack([out, out[::-1], aside]), corners)
    assert (leg[:50] <= 1).all()
    assert (leg[51:99] <= 1).all()
    assert (leg[102:] == 2).all()
    bounded = legs_of(
        np.vstack([out, out[::-1], aside]), corners, *legs_between(np.arange(120.0), {0: 49.0, 1: 99.0}, 2)
    )
    assert bounded.tolist() == [0] * 50 + [1] * 50 + [2] * 20


def test_never_runs_backwards_under_noise() -> None:
    rng = np.random.default_rng(0)
    corners = rng.uniform(-10, 10, (30, 3))
    true = np.repeat(np.arange(29), 20)
    t = np.tile(np.linspace(0, 1, 20), 29)[:, None]
    track = corners[true] * (1 - t) + corners[true + 1] * t + rng.normal(0, 0.05, (580, 3))
    leg = legs_of(track, corners)
    assert (np.diff(leg) >= 0).all()
    assert (leg == true).mean() > 0.95


def test_corners_begin_and_end_at_home() -> None:
    plan = wall_plan()
    corners = mission_corners(plan)
    assert tuple(corners[0]) == tuple(corners[-1]) == plan.home_m
    assert len(corners) == len(plan.waypoints) + 4
    assert tuple(corners[3]) == plan.waypoints[1].position_m
