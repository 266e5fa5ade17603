"""The visiting order against all orders of small sets."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.camera import CameraPose
from tasks.planning.tour import improved, kicked, nearest_neighbour, to_and_fro, tour_cost, visiting_order
from tasks.planning.viewpoints import View


def distances(seed: int, count: int) -> np.ndarray:
    places = np.random.default_rng(seed).uniform(0, 10, (count, 3))
    return np.linalg.norm(places[:, None] - places[None], axis=2)


def test_small_tours_are_nearly_always_the_best() -> None:
    excess = []
    for seed in range(12):
        cost = distances(seed, 8)
        best = min(tour_cost(np.array([0, *p]), cost) for p in permutations(range(1, 8)))
        found = tour_cost(visiting_order(np.arange(8), lambda some, c=cost: c[np.ix_(some, some)]), cost)
        excess.append(found / best - 1)
    assert max(excess) < 0.02
    assert np.median(excess) < 1e-9


@settings(max_examples=50)
@given(st.integers(0, 10_000), st.integers(1, 40), st.booleans())
def test_improving_keeps_every_point_and_never_lengthens(seed: int, count: int, closed: bool) -> None:
    cost = distances(seed, count)
    start = np.random.default_rng(seed).permutation(count)
    better = improved(start, cost, closed)
    assert sorted(better) == list(range(count))
    assert better[0] == start[0]
    if closed:
        assert tour_cost(better, cost) <= tour_cost(start, cost) + 1e-9
    else:
        assert better[-1] == start[-1]
        assert cost[better[:-1], better[1:]].sum() <= cost[start[:-1], start[1:]].sum() + 1e-9


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.integers(8, 60), st.booleans(), st.booleans())
def test_kicking_keeps_every_point_and_never_lengthens(
    seed: int, count: int, closed: bool, metric: bool
) -> None:
    cost = distances(seed, count)
    if not metric:  # detours and turns make the table anything but a distance
        noise = np.random.default_rng(seed).uniform(0, 5, cost.shape)
        cost = cost + noise + noise.T
    start = improved(np.random.default_rng(seed).permutation(count), cost, closed)
    better = kicked(start, cost, closed)
    assert sorted(better) == list(range(count))
    assert better[0] == start[0]
    if closed:
        assert tour_cost(better, cost) <= tour_cost(start, cost) + 1e-9
    else:
        assert better[-1] == start[-1]
        assert cost[better[:-1], better[1:]].sum() <= cost[start[:-1], start[1:]].sum() + 1e-9


def test_a_long_tour_comes_near_its_known_best() -> None:
    """Points on a circle, shuffled: the best tour is the circle itself."""
    angle = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    places = np.column_stack([np.cos(angle), np.sin(angle)])[np.random.default_rng(0).permutation(300)]
    cost = np.linalg.norm(places[:, None] - places[None], axis=2)
    order = visiting_order(np.arange(300), lambda some: cost[np.ix_(some, some)])
    assert tour_cost(order, cost) == pytest.approx(300 * 2 * np.sin(np.pi / 300), rel=1e-6)


def test_nearest_neighbour_goes_to_the_nearest() -> None:
    x = np.array([0.0, 5.0, 1.0, 2.5])
    assert nearest_neighbour(np.abs(x[:, None] - x)).tolist() == [0, 2, 3, 1]


def test_long_tours_are_improved_in_stretches() -> None:
    places = np.random.default_rng(1).uniform(0, 100, (2001, 2))
    start = np.concatenate([[0], 1 + np.argsort(places[1:, 0] // 4 * 1000 + places[1:, 1])])

    def between(some: np.ndarray) -> np.ndarray:
        return np.linalg.norm(places[some, None] - places[None, some], axis=2)

    order = visiting_order(start, between)
    assert sorted(order) == list(range(2001))
    assert order[0] == 0
    length = [np.linalg.norm(np.diff(places[o], axis=0), axis=1).sum() for o in (start, order)]
    assert length[1] < 0.8 * length[0]


def test_rows_are_flown_to_and_fro() -> None:
    pose = CameraPose(position_m=(0.0, 0.0, 0.0), yaw_deg=0.0, pitch_deg=0.0)
    views = [View("wall-01", row, column, np.zeros(3), pose) for row in range(3) for column in range(4)]
    visited = [(views[i].row, views[i].column) for i in to_and_fro(views)]
    assert visited[:5] == [(0, 0), (0, 1), (0, 2), (0, 3), (1, 3)]
    steps = np.abs(np.diff(visited, axis=0)).sum(axis=1)
    assert (steps == 1).all()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_smallest_tours(count: int) -> None:
    cost = distances(0, count)
    order = visiting_order(np.arange(count), lambda some: cost[np.ix_(some, some)])
    assert sorted(order) == list(range(count))
