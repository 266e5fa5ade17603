"""The paper's clustering before RANSAC: isolated groups of points are trimmed."""

import numpy as np

from tasks.surfaces.cloud import Floats, Mask
from tasks.surfaces.clusters import euclidean_clusters


def in_large_groups(points_m: Floats, epsilon_m: float, area_m2: float) -> Mask:
    """(N,) points of groups whose extent could hold a plane patch of `area_m2`; groups are more than ε
    apart. A patch inside a box a × b × c has at most √((ab)² + (bc)² + (ca)²): its areas as seen along the
    axes are at most the box's sides."""
    labels = euclidean_clusters(points_m, epsilon_m)
    groups = int(labels.max(initial=-1)) + 1
    low, high = np.full((groups, 3), np.inf), np.full((groups, 3), -np.inf)
    np.minimum.at(low, labels, points_m)
    np.maximum.at(high, labels, points_m)
    a, b, c = (high - low).T
    return np.asarray((np.sqrt((a * b) ** 2 + (b * c) ** 2 + (c * a) ** 2) >= area_m2)[labels])
