"""The side to look from where nothing says where the scanners stood.

A merged cloud without normals and scanners shows places but not their sides. The air a scanner looked through
ends at something it also saw; the inside of a wall ends at the wall's own back, or at nothing. So of the two
ways along its normal a place is seen from the one that meets something beyond a structure's thickness, else
from the one that meets nothing, else from the longer one; else level places from above, others from outside.
"""

import numba
import numpy as np

from tasks.registration.rigid_motion import Array
from tasks.registration.voxel_grid import Indices, unit, voxel_keys, voxel_sums

TOLD_M = 0.25  # places this near that lie alike are judged as one
CELL_M = 0.1
SKIN_M = 0.15  # of a surface: its own noise is not in its way
THICK_M = 3.0  # parts of a structure are no thicker
FARTHEST_M = 30.0
LEVEL_COSINE = float(np.cos(np.radians(45.0)))
SAME_M = 0.2  # ways that differ by less are alike


def to_open_side(points_m: Array, normals: Array) -> Array:
    """(N, 3) normals, each turned to the side it was seen from, as far as the points tell."""
    axis = np.abs(normals).argmax(axis=1)
    positive = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] > 0
    alike = normals * np.where(positive, 1.0, -1.0)[:, None]
    keys = voxel_keys(points_m, TOLD_M, axis)
    group = np.unique(keys, return_inverse=True)[1]
    means = voxel_sums(keys, np.hstack([points_m, alike])).means
    places_m, facing = means[:, :3], unit(means[:, 3:])

    low = points_m.min(axis=0) - FARTHEST_M - 2 * CELL_M
    shape = np.ceil((points_m.max(axis=0) + FARTHEST_M + 2 * CELL_M - low) / CELL_M).astype(np.int64)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    occupied = np.unique((np.floor((points_m - low) / CELL_M).astype(np.int64) * strides).sum(axis=1))
    before, behind = (_likely(_free_m(places_m - low, way, occupied, strides)) for way in (facing, -facing))
    outward = places_m - np.median(places_m, axis=0)
    outward[:, 2] = 0.0
    level = np.abs(facing[:, 2]) > LEVEL_COSINE
    usual = np.where(level, facing[:, 2], np.einsum("ni,ni->n", outward, facing))
    sign = np.where(np.abs(before - behind) < SAME_M, usual, before - behind) >= 0
    return np.asarray(alike * np.where(sign[group], 1.0, -1.0)[:, None])


def _likely(free_m: Array) -> Array:
    """Larger for the likelier way: within a structure's thickness the longer, then nothing, then something
    beyond."""
    beyond = np.where(free_m < FARTHEST_M, THICK_M + 1.0 + free_m, THICK_M)
    return np.asarray(np.where(free_m < THICK_M, free_m, beyond))


@numba.njit(cache=True)
def _free_m(points: Array, directions: Array, occupied: Indices, strides: Indices) -> Array:
    free = np.full(len(points), FARTHEST_M)
    for n in range(len(points)):
        along = SKIN_M
        while along < FARTHEST_M:
            key = 0
            for axis in range(3):
                key += int((points[n, axis] + along * directions[n, axis]) // CELL_M) * strides[axis]
            at = np.searchsorted(occupied, key)
            if at < len(occupied) and occupied[at] == key:
                free[n] = along
                break
            along += CELL_M
    return free
