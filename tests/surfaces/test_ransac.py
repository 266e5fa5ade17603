import numpy as np

from tasks.surfaces.cloud import Cloud, unit
from tasks.surfaces.ransac import find_planes
from tests.surfaces.scanner import Box, scan


def test_all_seen_faces_of_a_box_in_one_go() -> None:
    cloud = scan([Box((0.0, 0.0, 0.0), (3.0, 2.0, 1.5))], [(-4.0, -5.0, 4.0), (7.0, 8.0, 4.0)])
    found = find_planes(cloud, 0.02, 0.35, 0.5, 0, lambda f: None)
    normals = {tuple(np.round(s.normal).astype(int).tolist()) for s in found if len(s.points) > 200}
    assert normals == {(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, 1)}
    taken = np.concatenate([s.points for s in found])
    assert len(np.unique(taken)) == len(taken)


def test_planes_are_found_among_two_thirds_of_clutter() -> None:
    rng = np.random.default_rng(0)
    wall = rng.uniform([0, 0, 0], [3, 0, 2], (3000, 3)) + [0, 1, 0] * rng.normal(0, 0.003, (3000, 1))
    clutter = rng.uniform([0, -1, 0], [3, 1, 2], (6000, 3))
    views = np.tile([0.0, -1.0, 0.0], (9000, 1))
    normals = np.concatenate([views[:3000], unit(rng.normal(size=(6000, 3)))])
    cloud = Cloud(np.concatenate([wall, clutter]), normals, views)
    found = find_planes(cloud, 0.02, 0.35, 0.5, 0, lambda f: None)
    best = max(found, key=lambda s: len(s.points))
    assert best.normal[1] < -np.cos(np.radians(0.1))
    assert (best.points < 3000).sum() > 2900


def test_a_handful_of_points_has_no_plane() -> None:
    few = np.zeros((3, 3))
    assert find_planes(Cloud(few, few, few), 0.02, 0.35, 0.5, 0, lambda f: None) == []
