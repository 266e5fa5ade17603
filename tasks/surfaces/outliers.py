"""The paper's noise filter: sparse outliers are left out."""

import numpy as np
from scipy.spatial import cKDTree

from tasks.surfaces.cloud import Floats, Mask

NEIGHBOURS = 8
FARTHEST_RATIO = 4.0  # a regular point's ratio stays below 2.5 even where the density steps


def sparse_outliers(points_m: Floats) -> Mask:
    """(N,) true for points that stand alone: their mean distance to the nearest neighbours is several
    times what those neighbours have among themselves.

    Rusu's statistical outlier removal compares with one mean of the whole cloud and so deletes whatever
    is far from the scanner, or thin: a cable. Compared with its own surroundings (as the local outlier
    factor does), a sparsely scanned surface or cable is as regular as a dense one.
    """
    if len(points_m) <= NEIGHBOURS:
        return np.zeros(len(points_m), dtype=bool)
    tree = cKDTree(points_m)
    distance_m, near = tree.query(points_m, k=NEIGHBOURS + 1, workers=-1)
    mean_m = distance_m[:, 1:].mean(axis=1)
    around_m = np.median(mean_m[near[:, 1:]], axis=1)
    return np.asarray(mean_m > FARTHEST_RATIO * around_m)
