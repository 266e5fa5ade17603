import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tasks.surfaces.cloud import unit
from tasks.surfaces.frame import Frame
from tasks.surfaces.plane_fit import fit_plane, fit_planes


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_a_noisy_plane_is_found_to_a_tenth_of_a_degree_and_a_millimetre(seed: int) -> None:
    rng = np.random.default_rng(seed)
    normal = unit(rng.normal(size=(1, 3)))[0]
    frame = Frame.on(rng.uniform(-100, 100, 3), normal)
    points = frame.world_m(rng.uniform(-1, 1, (2000, 2))) + rng.normal(0, 0.003, (2000, 1)) * normal
    centroid, found = fit_plane(points, normal)
    assert np.degrees(np.arccos(min(1.0, found @ normal))) < 0.1
    assert abs(frame.uvw_m(centroid[None])[0, 2]) < 0.001
    np.testing.assert_allclose(fit_plane(points, -normal)[1], -found)


def test_many_planes_at_once_are_the_same_as_one_by_one() -> None:
    rng = np.random.default_rng(0)
    points, group = rng.normal(size=(300, 3)), rng.integers(0, 3, 300)
    facings = np.eye(3)
    centroids, normals = fit_planes(points, group, facings)
    for k in range(3):
        centroid, normal = fit_plane(points[group == k], facings[k])
        np.testing.assert_allclose(centroids[k], centroid)
        np.testing.assert_allclose(normals[k], normal)
