import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tasks.surfaces.cloud import Cloud
from tasks.surfaces.voxels import thin, voxel_keys, voxelise


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 2.0))
def test_a_mean_lies_in_its_voxel_and_every_point_has_one(seed: int, voxel_m: float) -> None:
    points = np.random.default_rng(seed).uniform(-3, 3, (300, 3))
    up = np.tile([0.0, 0.0, 1.0], (300, 1))
    means, group = voxelise(Cloud(points, up, up), voxel_m)
    assert len(means) == len(np.unique(voxel_keys(points, voxel_m)))
    assert np.abs(means.points[group] - points).max() <= voxel_m
    np.testing.assert_allclose(thin(points, voxel_m), means.points)


def test_two_sides_of_a_thin_plate_stay_two() -> None:
    points = np.array([[0.01, 0.01, 0.011], [0.01, 0.01, 0.014]])
    side = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    assert len(voxelise(Cloud(points, side, side), 0.05)[0]) == 2
    assert len(voxelise(Cloud(points, side, side[[0, 0]]), 0.05)[0]) == 1  # one scanner saw both


def test_thin_of_nothing_is_nothing() -> None:
    assert thin(np.zeros((0, 3)), 0.05).shape == (0, 3)
