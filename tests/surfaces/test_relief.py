"""Heights over a surface's plane, from points of a scan."""

import numpy as np
import numpy.typing as npt
import pytest

from tasks.surfaces.relief import heights_of

Array = npt.NDArray[np.float64]
BOUNDS = (0.0, 0.0, 4.0, 2.0)


def height(uv: Array) -> Array:
    """1 cm waves, half a metre long."""
    return np.asarray(0.01 * np.sin(4 * np.pi * uv[:, 0]) * np.cos(4 * np.pi * uv[:, 1]))


def points(sigma_m: float, amplitude: float = 1.0, spacing_m: float = 0.02) -> Array:
    rng = np.random.default_rng(0)
    u, v = np.meshgrid(np.arange(0, 4, spacing_m), np.arange(0, 2, spacing_m))
    uv = np.column_stack([u.ravel(), v.ravel()]) + rng.uniform(-0.005, 0.005, (u.size, 2))
    return np.column_stack([uv, amplitude * height(uv) + rng.normal(0, sigma_m, len(uv))])


def errors(cloud: Array, inside_m: float = 0.1) -> Array:
    """At the grid's nodes well inside the surface."""
    found = heights_of(cloud, BOUNDS)
    assert found is not None
    r, c = np.indices(found.w_m.shape)
    uv = np.column_stack([found.left_m + c.ravel() * found.cell_m, found.bottom_m + r.ravel() * found.cell_m])
    inside = ((uv > inside_m) & (uv < np.array([4.0, 2.0]) - inside_m)).all(axis=1)
    return np.asarray(found.w_m.ravel() - height(uv))[inside]


def test_waves_are_found_better_than_the_scanners_noise() -> None:
    assert np.sqrt(np.mean(errors(points(0.003)) ** 2)) < 0.001


def test_it_says_how_well_it_knows_them() -> None:
    found = heights_of(points(0.003), BOUNDS)
    assert found is not None
    assert found.sigma_m == pytest.approx(np.std(errors(points(0.003))), rel=0.4)


def test_a_flat_wall_has_no_relief() -> None:
    assert heights_of(points(0.003, amplitude=0.0), BOUNDS) is None


def test_a_cable_before_the_wall_moves_nothing() -> None:
    cloud = points(0.001)
    cable = np.column_stack([np.linspace(0, 4, 400), np.full(400, 1.003), np.full(400, 0.08)])
    assert np.abs(errors(np.concatenate([cloud, cable]))).max() < 0.006


def test_what_no_point_tells_is_filled_from_around() -> None:
    cloud = points(0.001)
    hole = ((cloud[:, :2] > [1.4, 0.9]) & (cloud[:, :2] < [1.6, 1.1])).all(axis=1)
    off = errors(cloud[~hole])
    assert np.isfinite(off).all()
    assert np.abs(off).max() < 0.02


@pytest.mark.parametrize("cloud", [np.zeros((0, 3)), np.zeros((5, 3)), np.full((500, 3), 9.0)])
def test_too_few_points_tell_of_none(cloud: Array) -> None:
    assert heights_of(cloud, BOUNDS) is None
