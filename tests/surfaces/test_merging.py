import numpy as np

from tasks.surfaces.cloud import Cloud
from tasks.surfaces.merging import merge_planes
from tasks.surfaces.plane_fit import fit_plane
from tasks.surfaces.ransac import Support

UP = np.array([0.0, 0.0, 1.0])


def grid(x0: float, x1: float, z: float, spacing_m: float = 0.05) -> np.ndarray:
    x, y = np.meshgrid(np.arange(x0, x1, spacing_m), np.arange(0, 2, spacing_m))
    noise = np.random.default_rng(0).normal(0, 0.003, x.size)
    return np.column_stack([x.ravel(), y.ravel(), z + noise])


def merged(
    *pieces: np.ndarray, facings: tuple[float, ...] = (1.0, 1.0, 1.0), sides_known: bool = True
) -> list[Support]:
    points = np.concatenate(pieces)
    bounds = np.cumsum([0, *(len(p) for p in pieces)])
    supports = []
    for k, sign in zip(range(len(pieces)), facings, strict=False):
        own = np.arange(bounds[k], bounds[k + 1])
        centroid, normal = fit_plane(points[own], sign * UP)
        supports.append(Support(normal, centroid, own))
    return merge_planes(supports, Cloud(points, points, points, sides_known), 0.02, 0.35)


def test_pieces_of_one_plane_that_touch_are_joined() -> None:
    (whole,) = merged(grid(0, 2, 0.0), grid(2, 3, 0.004), grid(3, 5, 0.0))
    assert np.array_equal(whole.points, np.arange(len(whole.points)))
    assert abs(whole.normal[2]) > np.cos(np.radians(0.1))


def test_a_step_of_5_cm_parts_two_surfaces() -> None:
    assert len(merged(grid(0, 2, 0.0), grid(2, 4, 0.05))) == 2


def test_coplanar_pieces_far_apart_stay_two() -> None:
    assert len(merged(grid(0, 2, 0.0), grid(4, 6, 0.0))) == 2


def test_what_noise_split_in_one_place_is_joined() -> None:
    assert len(merged(grid(0, 4, 0.0), grid(0.5, 3.5, 0.035, 0.1))) == 1


def test_a_sheet_keeps_both_sides_however_thinly_one_was_scanned() -> None:
    assert len(merged(grid(0, 4, 0.0), grid(0, 4, -0.003, 0.15), facings=(1.0, -1.0))) == 2


def test_where_the_sides_are_not_known_the_side_with_more_points_has_all() -> None:
    sheet = grid(0, 4, 0.0), grid(0, 3, -0.003, 0.08)
    (whole,) = merged(*sheet, facings=(1.0, -1.0), sides_known=False)
    assert whole.normal[2] > 0
