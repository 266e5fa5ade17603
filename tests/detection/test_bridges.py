"""Pieces of a crack are joined where the network sees something between them, and nowhere else."""

import numpy as np
import pytest

from tasks.detection.bridges import LINK, bridged
from tasks.detection.components import components

EDGE = 102


def two_pieces(gap_px: int, between: int) -> np.ndarray:
    """A level line of three rows, likely but for a gap of `gap_px` columns."""
    p = np.zeros((20, 200), np.uint8)
    p[9:12, 10:190] = 250
    p[9:12, 100 - gap_px // 2 : 100 + gap_px // 2] = between
    return p


def pieces(mask: np.ndarray) -> int:
    return len(components(mask).area_px) - 1


@pytest.mark.parametrize(
    ("gap_px", "between", "expected"),
    [(20, LINK, 1), (20, EDGE - 1, 1), (20, LINK - 1, 2), (40, EDGE - 1, 2)],
    ids=["just seen", "nearly sure", "not seen", "too far"],
)
def test_a_gap_is_bridged_where_something_is_seen_in_it(gap_px: int, between: int, expected: int) -> None:
    joined = bridged(two_pieces(gap_px, between), EDGE, 30.0)
    assert pieces(joined) == expected
    added = joined & (two_pieces(gap_px, 0) < EDGE)
    assert added.sum() == (gap_px if expected == 1 else 0)  # one pixel wide


def test_what_is_faint_beside_a_crack_stays_out() -> None:
    """A tail and a side branch lead nowhere."""
    p = two_pieces(0, 250)
    p[9:12, 190:200] = EDGE - 1
    p[0:9, 60:63] = EDGE - 1
    assert (bridged(p, EDGE, 30.0) == (p >= EDGE)).all()


def test_nothing_gives_nothing() -> None:
    assert not bridged(np.zeros((30, 40), np.uint8), EDGE, 30.0).any()
