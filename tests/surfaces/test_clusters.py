import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tasks.surfaces.clusters import euclidean_clusters


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.floats(0.02, 1.5))
def test_clusters_are_the_components_of_all_pairs_within_epsilon(seed: int, epsilon_m: float) -> None:
    points = np.random.default_rng(seed).uniform(-2, 2, (200, 3))
    pairs = cKDTree(points).sparse_distance_matrix(cKDTree(points), epsilon_m)
    count, expected = connected_components(pairs + pairs.T, directed=False)
    labels = euclidean_clusters(points, epsilon_m)
    assert labels.max() + 1 == count
    assert len(np.unique(labels * count + expected)) == count  # one to one


def test_no_points_no_clusters() -> None:
    assert euclidean_clusters(np.zeros((0, 3)), 0.5).shape == (0,)
