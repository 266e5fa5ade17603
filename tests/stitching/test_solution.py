"""Which photos an adjustment must go without."""

from types import SimpleNamespace

import numpy as np

from tasks.stitching.pairs import Edge
from tasks.stitching.solution import _loosest
from tasks.stitching.tracks import Observations


def seen(counts: list[int]) -> Observations:
    photo = np.repeat(np.arange(len(counts)), counts)
    return Observations(photo, np.arange(len(photo)), np.zeros((len(photo), 2)))


def test_of_loose_neighbours_the_loosest_goes_first() -> None:
    """1 and 2 are neighbours, of 2 less was kept; 4 is loose by itself, 5 and 6 are equally loose."""
    none = np.zeros((0, 2), np.int64)
    edges = [Edge(a, b, none) for a, b in ((0, 1), (1, 2), (0, 4), (5, 6), (0, 5))]
    adjusted = SimpleNamespace(views=[None] * 7, observations=seen([90, 39, 30, 90, 38, 20, 20]))
    loose = _loosest({1, 2, 4, 5, 6}, edges, seen([100] * 7), adjusted)  # type: ignore[arg-type]
    assert loose == {2, 4, 5, 6}
