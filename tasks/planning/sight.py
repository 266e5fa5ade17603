"""What can be seen from where: rays against the structure's surfaces and what else was scanned."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import open3d as o3d
import shapely

from schemas.surface import Surface

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

THICKNESS_M = 0.15  # what lies within this of a target belongs to it: noise, roughness, edges
CUBE_M = 0.1  # points that belong to no surface are thinned to a grid of this size,
SWOLLEN = 2.0  # and each stands for a cube this much larger: no ray slips through a cell left empty
MOST_CUBES = 100_000

_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
_SIDES = np.array(
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
        *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
    ]
)


def outline_of(surface: Surface) -> shapely.Polygon:
    """The surface's outline with its holes, in its (u, v) metres."""
    return shapely.Polygon(surface.outline_m, surface.holes_m).buffer(0)


class Scene:
    """The surfaces' outlines as triangles, and small cubes where points belong to no surface."""

    def __init__(self, surfaces: Sequence[Surface], points_m: Array) -> None:
        self._scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        vertices = [_triangles(s) for s in surfaces]
        cubes = _cubes(surfaces, points_m)
        corners = np.concatenate([*vertices, cubes]).astype(np.float32)
        self._empty = not len(corners)
        if not self._empty:
            index = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
            self._scene.add_triangles(_tensor(corners), _tensor(index))

    def sees(self, eye_m: Array, targets_m: Array) -> Flags:
        """(N,) whether each target (N, 3) is seen from its eye ((3,) or (N, 3))."""
        ray = targets_m - eye_m
        distance = np.linalg.norm(ray, axis=1)
        if self._empty:
            return np.ones(len(ray), dtype=bool)
        eyes = np.broadcast_to(eye_m, ray.shape)
        rays = np.hstack([eyes, ray / np.maximum(distance, 1e-9)[:, None]]).astype(np.float32)
        hit = self._scene.cast_rays(_tensor(rays), nthreads=1)["t_hit"].numpy()
        return np.asarray(hit >= distance - THICKNESS_M)


def _tensor(array: npt.NDArray[Any]) -> o3d.core.Tensor:
    return o3d.core.Tensor.from_numpy(np.ascontiguousarray(array))


def _triangles(surface: Surface) -> Array:
    """(3·T, 3) corners of the triangles of a surface's outline less its holes."""
    parts = shapely.constrained_delaunay_triangles(outline_of(surface)).geoms
    uv = np.array([part.exterior.coords[:3] for part in parts]).reshape(-1, 2)
    return surface.to_world(uv) if len(uv) else np.empty((0, 3))


def _cubes(surfaces: Sequence[Surface], points_m: Array) -> Array:
    """(36·C, 3) triangle corners of cubes around the points that belong to no surface."""
    size = CUBE_M
    centres = _thinned(points_m, size)
    centres = centres[~_on_a_surface(surfaces, centres)]
    while len(centres) > MOST_CUBES:
        size *= 2
        centres = _thinned(centres, size)
    return np.asarray(centres[:, None, :] + SWOLLEN * size * _CORNERS[_SIDES.ravel()]).reshape(-1, 3)


def _thinned(points_m: Array, size_m: float) -> Array:
    """One point for each occupied cube of a grid, at the cube's middle."""
    if not len(points_m):
        return points_m
    cells = np.floor(points_m / size_m).astype(np.int64)
    low = cells.min(axis=0)
    shape = tuple(cells.max(axis=0) - low + 1)
    numbers = np.unique(np.ravel_multi_index(tuple((cells - low).T), shape))
    return np.asarray((np.column_stack(np.unravel_index(numbers, shape)) + low + 0.5) * size_m)


def _on_a_surface(surfaces: Sequence[Surface], points_m: Array) -> Flags:
    explained = np.zeros(len(points_m), dtype=bool)
    for surface in surfaces:
        near = np.flatnonzero((np.abs(surface.plane.signed_distance_m(points_m)) < THICKNESS_M) & ~explained)
        u, v, _ = surface.to_surface(points_m[near]).T
        area = outline_of(surface).buffer(THICKNESS_M)
        explained[near] = shapely.contains_xy(area, u, v)
    return explained
