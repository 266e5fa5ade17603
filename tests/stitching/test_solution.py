"""Which photos an adjustment must go without."""

import numpy as np

from tasks.stitching.pairs import Edge
from tasks.stitching.solution import _Kept, _loosest


def test_of_loose_neighbours_the_loosest_goes_first() -> None:
    """1 and 2 are neighbours, of 2 less was kept; 4 is loose by itself, 5 and 6 are equally loose."""
    none = np.zeros((0, 2), np.int64)
    edges = [Edge(a, b, none) for a, b in ((0, 1), (1, 2), (0, 4), (5, 6), (0, 5))]
    kept = _Kept(np.full(7, 100), np.array([90, 39, 30, 90, 38, 20, 20]))
    assert _loosest({1, 2, 4, 5, 6}, kept, edges) == {2, 4, 5, 6}
