"""Equal density: one mean point per occupied voxel."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


def voxel_groups(points_m: npt.NDArray[np.floating], voxel_m: float, extra: Indices | None = None) -> Indices:
    """(N,) group number of each point: points of one voxel (and one value of `extra`, 0…15) share it.

    Groups are numbered in the order of their voxels (x, then y, then z), whatever the points' order.
    """
    cells = np.floor(points_m / voxel_m).astype(np.int64)
    cells -= cells.min(axis=0)
    spans = cells.max(axis=0) + 1
    key = (cells[:, 0] * spans[1] + cells[:, 1]) * spans[2] + cells[:, 2]
    if extra is not None:
        key = key * 16 + extra
    return np.asarray(np.unique(key, return_inverse=True)[1], dtype=np.int64)


def group_means(values: npt.NDArray[np.floating], groups: Indices, weights: Array | None = None) -> Array:
    """(G, K) mean of the (N, K) values of each group."""
    total = np.bincount(groups, weights)
    columns = [np.bincount(groups, v if weights is None else v * weights) for v in values.T]
    return np.asarray(np.column_stack(columns) / total[:, None])


def unit(vectors: npt.NDArray[np.floating]) -> Array:
    """Rows of length one; zero rows stay zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 1e-12, length, 1.0), dtype=np.float64)
