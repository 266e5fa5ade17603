"""The height of a failsafe's way home, against the points by brute force."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from schemas.flight_plan import Flight, Waypoint
from tasks.planning.airspace import Airspace
from tasks.planning.way_home import CONE, LEAST_M, RISE_M, return_height_m
from tests.planning.structures import box

INFLATION_M = 1.0
HOME, TOP = (0.0, 0.0, 0.0), (0.0, 0.0, 2.5)
GROUND = box((-20, -20, -0.2), (40, 20, 0))


def height(points: np.ndarray, *places: tuple[float, float, float]) -> float | None:
    airspace = Airspace(np.vstack([GROUND, points]), INFLATION_M, 0.5, 60.0)
    waypoints = [Waypoint(kind="intermediate", position_m=place, yaw_deg=0.0) for place in places]
    flight = Flight(first=0, last=len(places) - 1, photos=0, length_m=1.0, duration_s=1.0, battery=0.1)
    return return_height_m(waypoints, [flight], HOME, TOP, airspace)


def nearest_m(points: np.ndarray, place: tuple[float, float, float], rtl_alt_m: float) -> float:
    """Of the scanned points, to the way home of an ArduCopter from there."""
    x, y, z = place
    back = max(z, min(rtl_alt_m, CONE * float(np.hypot(x, y))))
    corners = np.array([place, (x, y, back), (0, 0, back), TOP])
    t = np.linspace(0, 1, 2001)[:, None]
    way = np.concatenate([a + t * (b - a) for a, b in pairwise(corners)])
    return float(cKDTree(points).query(way)[0].min())


def test_over_open_ground_the_lowest_height_will_do() -> None:
    assert height(np.empty((0, 3)), (10.0, 0.0, 4.0), (20.0, 5.0, 4.0)) == LEAST_M


def test_a_wall_between_is_flown_over_with_the_clearance_and_not_higher() -> None:
    wall = box((9.8, -20, 0), (10.2, 20, 6))
    around = ((10.0, 0.0, 8.0), (20.0, 0.0, 8.0), (20.0, 0.0, 3.0), (20.0, 0.0, 8.0), (10.0, 0.0, 8.0))
    least = height(wall, (0.0, 0.0, 8.0), *around, (0.0, 0.0, 8.0))
    assert least == pytest.approx(6 + INFLATION_M, abs=RISE_M + 0.05)
    assert nearest_m(wall, (20.0, 0.0, 3.0), least) >= INFLATION_M
    assert nearest_m(wall, (20.0, 0.0, 3.0), least - 2 * RISE_M) < INFLATION_M


def test_under_a_deck_it_stays_below() -> None:
    """As delivered (15 m) it would climb into the deck."""
    deck = box((5, -20, 9), (30, 20, 9.5))
    under = (15.0, 0.0, 5.0)
    least = height(deck, (4.0, 0.0, 5.0), under, (4.0, 0.0, 5.0))
    assert least is not None and least <= 8.0
    assert nearest_m(deck, under, least) >= INFLATION_M > nearest_m(deck, under, 15.0)


def test_behind_a_wall_that_reaches_to_the_deck_no_height_will_do() -> None:
    closed = np.vstack([box((5, -20, 9), (30, 20, 9.5)), box((9.8, -20, 0), (10.2, 10, 9.2))])
    ways = ((5.0, 15.0, 4.0), (20.0, 15.0, 4.0))
    assert height(closed, *ways, (20.0, 0.0, 4.0), *ways[::-1]) is None
