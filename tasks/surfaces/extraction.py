"""Surfaces and obstacles of a registered cloud: section 2.2 of the paper, step by step."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from schemas.obstacle import Obstacle
from schemas.problem import BadInput
from schemas.settings import SurfaceSettings
from schemas.surface import Surface
from tasks.surfaces.cables import cables
from tasks.surfaces.cloud import Cloud, Floats, Indices, Mask
from tasks.surfaces.clutter import in_clutter
from tasks.surfaces.curved import cut_curves
from tasks.surfaces.edges import with_edge_points, without_slivers
from tasks.surfaces.ground import is_ground, without_scraps
from tasks.surfaces.isolated import in_large_groups
from tasks.surfaces.merging import merge_planes
from tasks.surfaces.naming import name_surfaces
from tasks.surfaces.obstacles import obstacles, on_surfaces
from tasks.surfaces.outliers import sparse_outliers
from tasks.surfaces.patches import Patch, patches
from tasks.surfaces.ransac import Support, find_planes
from tasks.surfaces.structure import of_structure
from tasks.surfaces.terrain import Terrain, find_terrain
from tasks.surfaces.voxels import thin, voxelise

LARGEST_CELL_M = 0.5  # points of a plane farther apart than two cells are two surfaces
SLIVER = 4.0  # narrower than this many RANSAC distances is the rounded edge between two surfaces
GROUND_CELL_M = 1.0  # gaps of the ground up to twice this are closed; it need not be drawn finely
UP = np.array([0.0, 0.0, 1.0])
OCCUPIED_VOXEL_M = 0.05  # spacing of the points that planning keeps clear of


@dataclass(frozen=True)
class Extraction:
    surfaces: tuple[Surface, ...]
    obstacles: tuple[Obstacle, ...]
    occupied_m: Floats  # (M, 3) every point that a vehicle must not meet


def extract_structure(
    cloud: Cloud, settings: SurfaceSettings, item: str, on_progress: Callable[[float], None]
) -> Extraction:
    """Surfaces in the order of their names, obstacles likewise.

    Raises BadInput, naming `item`, where no flat surface of settings.min_area_m2 is found.
    """
    stray_m = np.zeros((0, 3))
    if settings.noise_filter:
        stray = sparse_outliers(cloud.points)
        stray_m, cloud = cloud.points[stray], cloud[~stray]
    on_progress(0.25)
    equal, voxel_of = cloud, np.arange(len(cloud))
    if settings.voxel_m is not None:
        equal, voxel_of = voxelise(cloud, settings.voxel_m)
    terrain = find_terrain(equal, settings.min_area_m2)
    floors = _floors(cloud, terrain, voxel_of, settings)
    on_progress(0.35)
    flat = _flat_patches(cloud, equal, terrain, voxel_of, settings, lambda f: on_progress(0.35 + 0.45 * f))
    cluttered = in_clutter([*floors, *flat], cloud.points, settings.distance_m)[len(floors) :]
    flat = [patch for patch, is_clutter in zip(flat, cluttered, strict=True) if not is_clutter]
    found, ground = without_scraps(
        [*floors, *flat], [True] * len(floors) + is_ground([patch.surface for patch in flat], equal.points)
    )
    if not found:
        raise BadInput(
            item,
            f"no flat surface of at least {settings.min_area_m2:g} m² found in {len(cloud)} points",
            "Lower surfaces.min_area_m2, raise surfaces.distance_m for a noisy scanner, "
            "or check the unit of the scans",
        )
    built = of_structure(found, ground, cloud.points, settings.epsilon_m)
    surfaces = name_surfaces([patch.surface for patch in found], ground, built, settings.min_area_m2)

    left = np.ones(len(cloud), dtype=bool)
    left[np.concatenate([patch.points for patch in found])] = False
    rest = np.flatnonzero(left)
    rest = rest[~_explained(cloud.points[rest], terrain, surfaces, settings)]
    things, held = obstacles(cloud.points[rest], settings.epsilon_m)
    solid = np.ones(len(cloud), dtype=bool)
    solid[rest[~held]] = False
    stray_m = stray_m[~_explained(stray_m, terrain, surfaces, settings)]
    held_m = cloud.points[rest[held]]
    strung_m = cables(np.concatenate([stray_m, cloud.points[rest[~held]]]), held_m)
    if len(strung_m):
        things, _ = obstacles(np.concatenate([held_m, strung_m]), settings.epsilon_m)
    on_progress(1.0)
    occupied_m = np.concatenate([cloud.points[solid], strung_m])
    return Extraction(surfaces, things, thin(occupied_m, OCCUPIED_VOXEL_M))


def _explained(
    points_m: Floats, terrain: Terrain, surfaces: tuple[Surface, ...], settings: SurfaceSettings
) -> Mask:
    """(N,) which points belong to the ground or to a surface."""
    explained = terrain.carries(points_m)
    near_m, beside_m = 2 * settings.distance_m, _cell_m(settings) / 2
    explained[~explained] = on_surfaces(points_m[~explained], surfaces, near_m, beside_m)
    return explained


def _floors(cloud: Cloud, terrain: Terrain, voxel_of: Indices, settings: SurfaceSettings) -> list[Patch]:
    """The pieces of ground, each with the plane that fits it best."""
    narrowest_m, smallest_m2 = SLIVER * settings.distance_m, settings.min_area_m2
    return [
        patch
        for support in _points_of(terrain.pieces, voxel_of)
        for patch in patches(cloud.points, support, UP, narrowest_m, GROUND_CELL_M, smallest_m2)
    ]


def _flat_patches(
    cloud: Cloud,
    equal: Cloud,
    terrain: Terrain,
    voxel_of: Indices,
    settings: SurfaceSettings,
    on_progress: Callable[[float], None],
) -> list[Patch]:
    """Planes found at equal density off the ground, then cut into surfaces and fitted on all their points."""
    planes, voxels = flat_planes(equal, terrain, settings, lambda f: on_progress(0.5 * f))
    supports = _points_of(voxels, voxel_of)
    narrowest_m, smallest_m2 = SLIVER * settings.distance_m, settings.min_area_m2
    found: list[Patch] = []
    for number, (plane, support) in enumerate(zip(planes, supports, strict=True)):
        on_progress(0.5 + 0.5 * number / len(planes))
        found += patches(cloud.points, support, plane.normal, narrowest_m, _cell_m(settings), smallest_m2)
    return found


def flat_planes(
    equal: Cloud, terrain: Terrain, settings: SurfaceSettings, on_progress: Callable[[float], None]
) -> tuple[list[Support], list[Indices]]:
    """The planes off the ground of a cloud at equal density, and the indices of the points on each."""
    cell_m = _cell_m(settings)
    standing = np.ones(len(equal), dtype=bool)
    standing[np.concatenate([[], *terrain.pieces]).astype(np.int64)] = False
    searched = np.flatnonzero(standing)
    if settings.clustering:
        large = in_large_groups(equal.points[searched], settings.epsilon_m, settings.min_area_m2)
        searched = searched[large]
    part = equal[searched]
    planes = find_planes(part, settings.distance_m, cell_m, settings.min_area_m2, settings.seed, on_progress)
    planes = merge_planes(planes, part, settings.distance_m, cell_m)
    planes = without_slivers(planes, part, settings.distance_m)
    planes = cut_curves(planes, part, settings.distance_m, cell_m)
    return planes, [searched[own] for own in with_edge_points(planes, part, settings.distance_m)]


def _cell_m(settings: SurfaceSettings) -> float:
    """Side of the cells that samples are drawn in: the smallest surface fills several."""
    return min(float(np.sqrt(settings.min_area_m2)) / 2, LARGEST_CELL_M)


def _points_of(supports: list[Indices], voxel_of: Indices) -> list[Indices]:
    """For each support, given as voxels, the points that went into these voxels, ascending."""
    owner = np.full(int(voxel_of.max()) + 1, -1)
    for number, support in enumerate(supports):
        owner[support] = number
    owner_of_point = owner[voxel_of]
    order = np.argsort(owner_of_point, kind="stable")
    bounds = np.searchsorted(owner_of_point[order], np.arange(len(supports) + 1))
    return [order[start:end] for start, end in pairwise(bounds)]
