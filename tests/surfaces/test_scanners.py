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


def test_who_sees_things_all_round_sees_the_sky_too_but_not_through_the_tripod() -> None:
    seen = window(echoes((0, 360), (-60, 10)))
    assert seen == ScanWindow(lowest_deg=seen.lowest_deg)
    assert seen.lowest_deg == pytest.approx(-60.0)


def test_a_window_is_all_that_was_looked_at() -> None:
    seen = window(echoes((40, 140), (-20, 35)))
    assert seen.blind_deg == ((140.0, 40.0),)
    assert (seen.lowest_deg, seen.highest_deg) == pytest.approx((-20.0, 34.5))


def test_a_window_across_the_east_and_a_narrow_gap() -> None:
    seen = window(np.concatenate([echoes((-100, 30), (-60, 20)), echoes((40, 150), (-60, 20))]))
    assert seen.blind_deg == ((150.0, 260.0),)
    assert seen.highest_deg == 90.0
