"""Boxes leave out only what is far."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tasks.surfaces.boxes import Box, Sorted


@given(seed=st.integers(0, 10_000), count=st.integers(0, 60), margin_m=st.floats(0, 2))
def test_the_points_in_a_box_are_those_in_it(seed: int, count: int, margin_m: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * [1.0, 5.0, 2.0]
    box = Box.of(rng.normal(size=(4, 3))).grown(margin_m)
    within = ((points >= box.low) & (points <= box.high)).all(axis=1)
    assert Sorted(points).inside(box).tolist() == np.flatnonzero(within).tolist()


@given(seed=st.integers(0, 10_000))
def test_boxes_that_share_a_point_meet(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, two = rng.normal(size=(2, 5, 3))
    assert Box.of(np.vstack([one, two[:1]])).meets(Box.of(two))
    assert not Box.of(one).meets(Box.of(one + 10.0))
