"""Cables that echo here and there, beside a dense wall, and noise that is no cable."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from schemas.settings import SurfaceSettings
from tasks.surfaces.cables import cables
from tasks.surfaces.cloud import Cloud, Floats, unit
from tasks.surfaces.extraction import extract_structure

NOTHING = np.zeros((0, 3))
HALF_M = 10.0  # of the wall and the cable


def cable(apart_m: float, before_wall_m: float, rng: np.random.Generator) -> Floats:
    """(N, 3) echoes about `apart_m` from each other, on a cable that sags by half a metre."""
    x = -HALF_M + np.cumsum(rng.exponential(apart_m, int(2 * HALF_M / apart_m)))
    x = x[x < HALF_M]
    points = np.column_stack([x, np.full(len(x), -before_wall_m), 4.0 + 0.5 * (x / HALF_M) ** 2])
    return np.asarray(points + rng.normal(0.0, 0.004, points.shape))


@pytest.mark.parametrize("before_wall_m", [0.3, 1.5])
def test_a_cable_before_a_wall_is_occupied_between_its_echoes_too(before_wall_m: float) -> None:
    rng = np.random.default_rng(0)
    u, v = (axis.ravel() for axis in np.meshgrid(np.arange(-HALF_M, HALF_M, 0.04), np.arange(0.0, 7.0, 0.04)))
    wall = np.column_stack([u, rng.normal(0.0, 0.002, len(u)), v])
    echoes = cable(0.5, before_wall_m, rng)
    points = np.concatenate([wall, echoes])
    normals = np.tile([0.0, -1.0, 0.0], (len(points), 1))
    seen = Cloud(points, normals, unit(np.array([0.0, -15.0, 1.6]) - points))
    found = extract_structure(seen, SurfaceSettings(), "a wall", lambda fraction: None)
    x = np.linspace(echoes[:, 0].min(), echoes[:, 0].max(), 500)
    along = np.column_stack([x, np.full(500, -before_wall_m), 4.0 + 0.5 * (x / HALF_M) ** 2])
    assert cKDTree(found.occupied_m).query(along)[0].max() < 0.2
    assert [surface.name for surface in found.surfaces] == ["wall-south-01"]
    assert max(o.max_m[0] - o.min_m[0] for o in found.obstacles) > 0.99 * np.ptp(echoes[:, 0])


def test_noise_and_the_sheet_behind_an_edge_are_no_cables() -> None:
    rng = np.random.default_rng(1)
    noise = rng.uniform(0.0, 1.0, (3000, 3)) * (30.0, 30.0, 12.0)
    sheet = np.column_stack([rng.uniform(0, 10, 600), rng.uniform(0, 6, 600), rng.normal(0, 0.01, 600)])
    assert not len(cables(noise, NOTHING))
    assert len(cables(sheet, NOTHING)) < 100
    assert not len(cables(NOTHING, NOTHING))
    assert not len(cables(np.zeros((7, 3)), NOTHING))
