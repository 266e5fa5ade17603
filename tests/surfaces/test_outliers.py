import numpy as np

from tasks.surfaces.outliers import sparse_outliers


def test_lone_points_go_and_sparse_structure_stays() -> None:
    rng = np.random.default_rng(0)
    dense = np.column_stack([rng.random((20_000, 2)) * 4, rng.normal(0, 0.003, 20_000)])
    sparse = np.column_stack([rng.random((400, 2)) * 8 + [20, 0], np.zeros(400)])  # 20 times thinner, far out
    cable = np.column_stack([np.linspace(0, 5, 60), np.full(60, 2.0), np.full(60, 3.0)])
    lone = rng.uniform([-1, -1, 0.5], [5, 5, 2.5], (20, 3))
    found = sparse_outliers(np.concatenate([dense, sparse, cable, lone]))
    assert found[-20:].mean() >= 0.8
    assert found[20_000:20_400].sum() == 0
    assert found[20_400:20_460].sum() == 0
    assert found[:20_000].mean() < 0.001


def test_a_handful_of_points_is_left_alone() -> None:
    assert not sparse_outliers(np.zeros((3, 3))).any()
