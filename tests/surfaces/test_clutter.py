import numpy as np

from tasks.surfaces.clutter import in_clutter
from tasks.surfaces.patches import patches

SOUTH = np.array([0.0, -1.0, 0.0])


def test_a_plane_cut_through_a_bush_is_clutter_and_a_noisy_wall_is_not() -> None:
    rng = np.random.default_rng(0)
    wall = rng.uniform([0, 0, 0], [3, 0, 2], (3000, 3)) + [0, 1, 0] * rng.normal(0, 0.01, (3000, 1))
    bush = rng.uniform([5, -0.5, 0], [8, 0.5, 2], (30_000, 3))
    points = np.concatenate([wall, bush])
    found = []
    for low, high in ((0.0, 3.0), (5.0, 8.0)):
        own = np.flatnonzero((np.abs(points[:, 1]) < 0.02) & (points[:, 0] >= low) & (points[:, 0] <= high))
        found += patches(points, own, SOUTH, 0.08, 0.35, 0.5)
    assert in_clutter(found, points, 0.02) == [False, True]


def test_the_other_face_of_a_thin_plate_is_no_clutter() -> None:
    rng = np.random.default_rng(0)
    faces = [rng.uniform([0, y, 0], [3, y, 2], (3000, 3)) for y in (0.0, 0.03)]
    points = np.concatenate(faces)
    found = patches(points, np.arange(3000), SOUTH, 0.08, 0.35, 0.5)
    found += patches(points, np.arange(3000, 6000), -SOUTH, 0.08, 0.35, 0.5)
    assert in_clutter(found, points, 0.02) == [False, False]
