"""Where a scanner looked, told from its echoes."""

import numpy as np
import pytest

from schemas.scan_window import ScanWindow
from tasks.surfaces.cloud import Floats
from tasks.surfaces.scanners import window


def echoes(azimuth_deg: tuple[float, float], elevation_deg: tuple[float, float]) -> Floats:
    """(N, 3) on a ball of 10 m, half a degree apart."""
    turn = np.radians(np.arange(*azimuth_deg, 0.5) + 0.25)
    up = np.radians(np.arange(*elevation_deg, 0.5))
    a, e = (angle.ravel() for angle in np.meshgrid(turn, up))
    return np.asarray(10.0 * np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]))


def skyline(least_deg: float, most_deg: float, head_deg: float = 90.0) -> Floats:
    """Things all round, every 20° as high as it happens, at another distance; seen by a head that turns up so
    far."""
    rng = np.random.default_rng(0)
    things = []
    for azimuth in range(0, 360, 20):
        highest = min(rng.uniform(least_deg, most_deg), head_deg)
        things.append(rng.uniform(0.5, 3.0) * echoes((azimuth, azimuth + 20), (-60, highest)))
    return np.concatenate(things)


def test_who_sees_things_all_round_sees_the_sky_too_but_not_through_the_tripod() -> None:
    seen = window(skyline(5, 70))
    assert seen == ScanWindow(lowest_deg=seen.lowest_deg)
    assert seen.lowest_deg == pytest.approx(-60.0)


def test_a_window_is_all_that_was_looked_at() -> None:
    seen = window(echoes((40, 140), (-20, 35)))
    assert seen.blind_deg == ((140.0, 40.0),)
    assert (seen.lowest_deg, seen.highest_deg) == pytest.approx((-20.0, 34.5))


def test_a_window_across_the_east_and_a_narrow_gap() -> None:
    seen = window(np.concatenate([echoes((-100, 30), (-60, 1)), echoes((40, 150), (-60, 2))]))
    assert seen.blind_deg == ((150.0, 260.0),)
    assert seen.highest_deg == 90.0


def test_a_head_that_turns_no_further_saw_no_sky() -> None:
    """Under a ceiling, among things of many heights, and with an echo of a bird."""
    bird = 20.0 * np.array([[0.1, 0.1, 1.0]])
    assert window(echoes((0, 360), (-60, 15.5))).highest_deg == pytest.approx(15.0, abs=0.1)
    among = np.concatenate([skyline(5, 70, 40.0), bird])
    assert window(among).highest_deg == pytest.approx(39.5, abs=0.6)


def test_the_top_of_walls_is_no_stop() -> None:
    """A square yard between walls of 10 m, 12 m wide: no side is as high all along."""
    turn, up = np.radians(np.arange(0.25, 360, 0.5)), np.radians(np.arange(-60.0, 89.0, 0.5))
    a, e = (angle.ravel() for angle in np.meshgrid(turn, up))
    away = 6.0 / np.maximum(np.abs(np.cos(a)), np.abs(np.sin(a)))
    wall = np.column_stack([away * np.cos(a), away * np.sin(a), away * np.tan(e)])
    assert window(wall[wall[:, 2] < 10.0]).highest_deg == 90.0


def test_the_horizon_is_no_stop() -> None:
    assert window(echoes((0, 360), (-60, 0))).highest_deg == 90.0
