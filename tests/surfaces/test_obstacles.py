import numpy as np
import pytest

from tasks.surfaces.obstacles import hull_vertices, obstacles


def cube(corner: tuple[float, float, float], side_m: float, count: int = 300) -> np.ndarray:
    return np.random.default_rng(0).random((count, 3)) * side_m + corner


def test_clusters_are_more_than_epsilon_apart_and_named_from_west_to_east() -> None:
    points = np.concatenate(
        [cube((5.0, 0.0, 0.0), 0.5), cube((0.0, 0.0, 0.0), 0.5), cube((0.0, 1.2, 0.0), 0.5)]
    )
    found, held = obstacles(points, 0.5)
    assert [o.name for o in found] == ["obstacle-01", "obstacle-02", "obstacle-03"]
    assert [o.points for o in found] == [300, 300, 300]
    assert held.all()
    assert found[0].max_m == pytest.approx((0.5, 0.5, 0.5), abs=0.03)
    assert found[2].min_m == pytest.approx((5.0, 0.0, 0.0), abs=0.03)
    assert len(obstacles(points, 1.0)[0]) == 2


def test_stray_points_are_noise() -> None:
    found, held = obstacles(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [9.0, 0.0, 0.0]]), 0.5)
    assert found == ()
    assert not held.any()


def test_nothing_left_nothing_found() -> None:
    assert obstacles(np.zeros((0, 3)), 0.5)[0] == ()


@pytest.mark.parametrize(
    ("scale", "expected"), [((1, 1, 1), 8), ((1, 1, 0), 4), ((1, 0, 0), 2), ((0, 0, 0), 1)]
)
def test_hull_of_a_box_a_sheet_a_cable_and_a_point(scale: tuple[int, int, int], expected: int) -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    inside = np.random.default_rng(0).uniform(0.1, 0.9, (50, 3))
    turned = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    hull = hull_vertices(np.concatenate([corners, inside]) * scale @ turned + [5.0, 6.0, 7.0])
    assert len(np.unique(np.round(hull, 9), axis=0)) == expected
