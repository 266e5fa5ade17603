import numpy as np

from tasks.surfaces.cloud import Cloud, unit
from tasks.surfaces.edges import with_edge_points, without_slivers
from tasks.surfaces.plane_fit import fit_plane
from tasks.surfaces.ransac import Support

RNG = np.random.default_rng(0)
WALL = RNG.uniform([0, 0, 0], [3, 0, 2], (4000, 3))  # faces south; the floor lies before it
FLOOR = RNG.uniform([0, -2, 0], [3, 0, 0], (4000, 3))
POINTS = np.concatenate([WALL, FLOOR]) + RNG.normal(0, 0.002, (8000, 3))
CLOUD = Cloud(POINTS, np.zeros((8000, 3)), unit(np.array([1.5, -5.0, 4.0]) - POINTS))
SOUTH, UP = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def support(points: np.ndarray, facing: np.ndarray) -> Support:
    centroid, normal = fit_plane(POINTS[points], facing)
    return Support(normal, centroid, points)


def test_edge_points_go_to_the_nearest_plane() -> None:
    inner_wall = np.flatnonzero(POINTS[:4000, 2] > 0.08)
    inner_floor = 4000 + np.flatnonzero(POINTS[4000:, 1] < -0.08)
    wall, floor = with_edge_points([support(inner_wall, SOUTH), support(inner_floor, UP)], CLOUD, 0.02)
    assert len(wall) + len(floor) == 8000
    assert (wall < 4000).mean() > 0.99
    assert (floor >= 4000).mean() > 0.99


def test_a_bent_sliver_between_two_planes_is_dissolved() -> None:
    strip = np.flatnonzero((np.abs(POINTS[:, 1]) < 0.03) & (POINTS[:, 2] < 0.03))
    rest = np.setdiff1d(np.arange(8000), strip)
    planes = [support(rest[rest < 4000], SOUTH), support(rest[rest >= 4000], UP)]
    sliver = support(strip, SOUTH + UP)
    assert without_slivers([sliver, *planes], CLOUD, 0.02) == sorted(planes, key=lambda s: -len(s.points))
