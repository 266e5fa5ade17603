"""Clearance against the raw points, found by brute force."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from tasks.planning.airspace import STEP_M, Airspace
from tasks.planning.allowed import Block
from tests.planning.structures import box, wall


def test_says_why_a_place_is_not_free() -> None:
    airspace = Airspace(wall().cloud, inflation_m=1.5, min_altitude_m=0.5, max_altitude_m=20.0)
    places = np.array([[0, -4, 5], [0, -1, 5], [15, 15, -3], [0, -4, 25]], dtype=float)
    assert airspace.blocks(places).tolist() == [Block.FREE, Block.NEAR, Block.LOW, Block.HIGH]


@settings(max_examples=40)
@given(st.integers(0, 10_000))
def test_a_free_segment_keeps_its_clearance_everywhere(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-5, 5, (30, 3))
    inflation = 1.0
    airspace = Airspace(points, inflation, min_altitude_m=-100.0, max_altitude_m=100.0)
    starts, ends = rng.uniform(-8, 8, (2, 20, 3))
    free = airspace.segments_free(starts, ends)
    along = np.linspace(0, 1, 4001)[:, None, None]
    nearest = cKDTree(points).query(starts + along * (ends - starts))[0].min(axis=0)
    assert (nearest[free] >= inflation - 1e-4).all()
    assert free[nearest >= inflation + STEP_M].all()  # and none is refused that is clearly free


def test_a_segment_that_dips_between_its_free_ends_is_refused() -> None:
    airspace = Airspace(box((-1, -1, 0), (1, 1, 10)), 1.0, 0.0, 100.0)
    start, end = np.array([[-5.0, 0, 5]]), np.array([[5.0, 0, 5]])
    assert airspace.is_free(start).all()
    assert airspace.is_free(end).all()
    assert not airspace.segments_free(start, end).any()
