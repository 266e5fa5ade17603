"""Which surfaces are of the structure, and which of cars and other things that stand apart from it."""

from collections.abc import Sequence

import numpy as np

from tasks.surfaces.cloud import Floats
from tasks.surfaces.clusters import euclidean_clusters
from tasks.surfaces.patches import Patch
from tasks.surfaces.voxels import voxel_keys

PART = 0.2  # of the largest group's area: a second pier, a wing wall; a car has less
SPACING_M = 0.1  # of the points that groups are told by


def of_structure(
    found: Sequence[Patch], ground: Sequence[bool], points_m: Floats, epsilon_m: float
) -> list[bool]:
    """True for surfaces of groups that have a good part of all area; groups are more than ε apart, the ground
    does not join them. points_m: (N, 3) the whole cloud, which the patches index."""
    standing = [number for number, is_floor in enumerate(ground) if not is_floor]
    if not standing:
        return [True] * len(found)
    points, owners = [], []
    for number in standing:
        own = points_m[found[number].points]
        own = own[np.unique(voxel_keys(own, SPACING_M), return_index=True)[1]]
        points.append(own)
        owners.append(np.full(len(own), number))
    labels = euclidean_clusters(np.concatenate(points), epsilon_m)
    owner = np.concatenate(owners)
    group = np.zeros(len(found), dtype=np.int64)
    for number in standing:
        group[number] = np.bincount(labels[owner == number]).argmax()
    areas_m2 = np.bincount(group[standing], weights=[found[number].surface.area_m2 for number in standing])
    large = areas_m2 >= PART * areas_m2.max()
    return [is_floor or bool(large[group[number]]) for number, is_floor in enumerate(ground)]
