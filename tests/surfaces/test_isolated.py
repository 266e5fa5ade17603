import numpy as np

from tasks.surfaces.isolated import in_large_groups


def test_groups_too_small_for_a_surface_are_trimmed() -> None:
    rng = np.random.default_rng(0)
    wall = rng.random((2000, 3)) * [2.0, 0.0, 1.0]
    bird = rng.random((50, 3)) * 0.4 + [0.0, 5.0, 3.0]  # at most √3 · 0.16 m²
    kept = in_large_groups(np.concatenate([wall, bird]), 0.5, 0.5)
    assert kept[:2000].all()
    assert not kept[2000:].any()
