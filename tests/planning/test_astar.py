"""A* against scipy's Dijkstra on the identical graph, and against the definition of its cost."""

from itertools import product

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from tasks.planning.astar import PathFinder

Flags = npt.NDArray[np.bool_]


def may_step(free: Flags, cell: npt.NDArray[np.int64], step: tuple[int, int, int]) -> bool:
    """Written apart from the search: all voxels of the box between a voxel and its neighbour are free."""
    for part in product(*[sorted({0, s}) for s in step]):
        there = cell + part
        if (there < 0).any() or (there >= free.shape).any() or not free[tuple(there)]:
            return False
    return True


def graph(free: Flags, weights: tuple[float, float, float]) -> csr_array:
    numbers = np.arange(free.size).reshape(free.shape)
    rows, columns, costs = [], [], []
    for cell in np.argwhere(free):
        for step in product((-1, 0, 1), repeat=3):
            if any(step) and may_step(free, cell, step):
                rows.append(numbers[tuple(cell)])
                columns.append(numbers[tuple(cell + step)])
                costs.append(sum(w * s * s for w, s in zip(weights, step, strict=True)))
    return csr_array((costs, (rows, columns)), shape=(free.size, free.size))


@pytest.mark.parametrize("weights", [(1.0, 1.0, 1.0), (0.7, 1.3, 2.9)])
@pytest.mark.parametrize("seed", range(4))
def test_cost_equals_dijkstra(seed: int, weights: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(seed)
    free = rng.random((9, 8, 7)) > 0.35
    cells = np.argwhere(free)
    start = tuple(cells[0].tolist())
    costs = dijkstra(graph(free, weights), indices=int(np.ravel_multi_index(start, free.shape)))
    finder = PathFinder(free, weights)
    for goal in cells:
        truth = costs[np.ravel_multi_index(tuple(goal), free.shape)]
        found = finder.path(start, tuple(goal.tolist()))
        assert (found is None) == np.isinf(truth)
        if found is not None:
            assert found[1] == pytest.approx(truth, abs=1e-9)


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_the_path_adds_up_and_cuts_no_corner(seed: int) -> None:
    rng = np.random.default_rng(seed)
    free = rng.random((8, 8, 8)) > 0.3
    weights = (1.0, 2.0, 0.5)
    start, goal = (tuple(c.tolist()) for c in rng.choice(np.argwhere(free), 2))
    found = PathFinder(free, weights).path(start, goal)
    if found is None:
        return
    cells, cost = found
    assert tuple(cells[0]) == start
    assert tuple(cells[-1]) == goal
    steps = np.diff(cells, axis=0)
    assert np.abs(steps).max(initial=0) <= 1
    assert cost == pytest.approx(float(((steps**2) * weights).sum()))
    assert all(may_step(free, c, tuple(s)) for c, s in zip(cells, steps, strict=False))


def test_of_equal_costs_the_shortest_is_taken() -> None:
    # Weighted Manhattan: six straight steps cost what three diagonal ones do, and are longer.
    cells, cost = PathFinder(np.ones((4, 4, 4), dtype=bool), (1.0, 1.0, 1.0)).path((0, 0, 0), (3, 3, 0)) or (
        [],
        0,
    )
    assert cost == 6.0
    assert len(cells) == 4


def test_no_way_is_said() -> None:
    free = np.ones((5, 5, 5), dtype=bool)
    free[2] = False
    finder = PathFinder(free, (1.0, 1.0, 1.0))
    assert finder.path((0, 0, 0), (4, 4, 4)) is None
    assert finder.path((0, 0, 0), (2, 0, 0)) is None
    assert finder.path((0, 0, 0), (1, 4, 4)) is not None  # the tables are clean after a failed search
