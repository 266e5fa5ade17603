"""Voxelisation: equal density everywhere (paper, section 2.2)."""

import numpy as np

from tasks.surfaces.cloud import Cloud, Floats, Indices, unit


def voxel_keys(points_m: Floats, voxel_m: float) -> Indices:
    """(N,) one integer per voxel, ordered by x, then y, then z."""
    cells = np.floor(points_m / voxel_m).astype(np.int64)
    cells -= cells.min(axis=0)
    _, ny, nz = cells.max(axis=0) + 1  # nx · ny · nz fits an int64: cloud.py bounds the extent
    return np.asarray((cells[:, 0] * ny + cells[:, 1]) * nz + cells[:, 2])


def voxelise(cloud: Cloud, voxel_m: float) -> tuple[Cloud, Indices]:
    """The mean point of each voxel and facing, and (N,) which of these means each point went into.

    Points of one voxel that face different ways (the six axis directions, seen from the scanner) are not
    mixed: the two sides of a thin plate stay two, an edge stays sharp.
    """
    outward = np.where(np.einsum("ni,ni->n", cloud.normals, cloud.views) < 0, -1.0, 1.0)
    normals = cloud.normals * outward[:, None]
    axis = np.abs(normals).argmax(axis=1)
    negative = np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0
    keys = voxel_keys(cloud.points, voxel_m) * 6 + axis * 2 + negative
    group = np.unique(keys, return_inverse=True)[1]
    means = [group_means(values, group) for values in (cloud.points, normals, cloud.views)]
    return Cloud(means[0], unit(means[1]), unit(means[2]), cloud.sides_known), group


def thin(points_m: Floats, voxel_m: float) -> Floats:
    """The mean point of each voxel."""
    if not len(points_m):
        return points_m
    return group_means(points_m, np.unique(voxel_keys(points_m, voxel_m), return_inverse=True)[1])


def group_means(values: Floats, group: Indices) -> Floats:
    counts = np.bincount(group)
    return np.column_stack([np.bincount(group, weights=column) / counts for column in values.T])
