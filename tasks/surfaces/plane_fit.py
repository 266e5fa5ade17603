"""The least-squares plane of points, and of many groups of points at once."""

import numpy as np

from tasks.surfaces.cloud import Floats, Indices


def fit_plane(points_m: Floats, facing: Floats) -> tuple[Floats, Floats]:
    """(centroid (3,), unit normal (3,) on the side of `facing`) that minimise the squared distances."""
    centroids, normals = fit_planes(points_m, np.zeros(len(points_m), dtype=np.int64), facing[None])
    return centroids[0], normals[0]


def fit_planes(points_m: Floats, group: Indices, facings: Floats) -> tuple[Floats, Floats]:
    """(G, 3) centroids and (G, 3) unit normals of the groups 0 … G − 1.

    Sums run in the order of the points, never through BLAS: the same bytes for any number of threads.
    """
    groups = len(facings)
    counts = np.maximum(np.bincount(group, minlength=groups), 1)
    centroids = np.column_stack([np.bincount(group, column, groups) / counts for column in points_m.T])
    x, y, z = (points_m - centroids[group]).T
    moments = [np.bincount(group, product, groups) for product in (x * x, x * y, x * z, y * y, y * z, z * z)]
    xx, xy, xz, yy, yz, zz = moments
    covariance = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1).reshape(groups, 3, 3)
    normals = np.linalg.eigh(covariance)[1][:, :, 0]
    flipped = np.where(np.einsum("gi,gi->g", normals, facings) < 0, -1.0, 1.0)
    return centroids, normals * flipped[:, None]
