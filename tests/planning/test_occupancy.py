"""The grid's promise: a free voxel keeps the inflation in all of its volume, checked on the raw points."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree

from tasks.planning.airspace import Airspace
from tasks.planning.occupancy import voxel_grid
from tests.planning.structures import box, wall


def grid_of(points: np.ndarray, inflation: float = 1.2, voxel: float = 0.25):  # type: ignore[no-untyped-def]
    airspace = Airspace(points, inflation, min_altitude_m=0.5, max_altitude_m=12.0)
    return airspace, voxel_grid(airspace, np.array([-8.0, -8, 0]), np.array([8.0, 8, 14]), voxel)


def test_a_free_voxel_is_free_to_its_corners() -> None:
    airspace, grid = grid_of(wall().cloud)
    rng = np.random.default_rng(0)
    cells = rng.choice(np.argwhere(grid.free), 3000)
    inside = grid.centres_m(cells) + rng.uniform(-0.5, 0.5, (3000, 3)) * grid.voxel_m
    assert cKDTree(airspace.points_m).query(inside)[0].min() >= 1.2
    assert inside[:, 2].min() >= 0.5
    assert inside[:, 2].max() <= 12.0 + grid.voxel_m


def test_it_blocks_no_more_than_it_must() -> None:
    airspace, grid = grid_of(wall().cloud)
    centres = grid.centres_m(np.random.default_rng(1).choice(np.argwhere(~grid.free), 5000))
    nearest = cKDTree(airspace.points_m).query(centres, distance_upper_bound=3.0)[0]
    needed = 1.2 + np.sqrt(3) / 2 * grid.voxel_m
    within = (centres[:, 2] > 0.7) & (centres[:, 2] < 12.0)
    assert nearest[within].max() < needed + 1e-9


def test_a_closed_box_is_a_component_of_its_own() -> None:
    _, grid = grid_of(box((-5.0, -5.0, 0.0), (5.0, 5.0, 9.0)), inflation=0.6)
    inside, outside = (grid.component[tuple(grid.cells(np.array(p))[0])] for p in ([0, 0, 5], [7, 7, 5]))
    assert inside > 0
    assert outside > 0
    assert inside != outside


def test_components_are_what_steps_without_cut_corners_connect() -> None:
    free = np.zeros((3, 3, 3), dtype=bool)
    free[0, 0, 0] = free[1, 1, 0] = True  # touch at an edge only
    assert ndimage.label(free)[1] == 2


def test_too_many_voxels_grow_instead(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tasks.planning.occupancy.MOST_CELLS", 1_000_000)
    airspace = Airspace(wall().cloud, 1.2, 0.5, 200.0)
    grid = voxel_grid(airspace, np.array([-100.0, -100, 0]), np.array([100.0, 100, 60]), 0.1)
    assert grid.free.size <= 1.1 * 1_000_000
    assert grid.voxel_m > 0.1


def test_a_place_is_entered_from_the_nearest_voxel() -> None:
    airspace, grid = grid_of(wall().cloud)
    near_the_wall = np.array([0.0, -1.25, 5.0])  # free itself, its voxel is not
    assert airspace.is_free(near_the_wall[None]).all()
    entrance = grid.entrance(near_the_wall, airspace)
    assert entrance is not None
    assert grid.free[entrance]
    assert np.linalg.norm(grid.centres_m(entrance) - near_the_wall) < 0.6
