"""Scans of which one is in another unit."""

import numpy as np
import pytest

from tasks.registration.stated_unit import other_unit

ROOM = np.random.default_rng(1).uniform(-6, 6, (4000, 3))


@pytest.mark.parametrize("factor", [3.281, 0.1, 100, 0.001])
def test_a_scan_larger_or_smaller_by_a_units_factor_is_told(factor: float) -> None:
    scans = {"a.ply": ROOM, "odd.ply": 1.15 * factor * ROOM}
    told = other_unit("odd.ply", scans)
    assert told.startswith(" odd.ply is ") and "the other 20.3 m: is its unit stated right?" in told
    assert "the others" in other_unit("odd.ply", scans | {"b.ply": ROOM})


def test_scans_alike_or_alone_are_not() -> None:
    assert other_unit("a", {"a": ROOM}) == other_unit("a", {"a": ROOM, "b": 1.7 * ROOM}) == ""
