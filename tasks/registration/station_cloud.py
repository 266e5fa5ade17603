"""A station made ready for registration: its cloud at equal density with normals, at two resolutions."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import small_gicp
from scipy.spatial import cKDTree

from tasks.registration.open_side import to_open_side
from tasks.registration.read_scan import LoadedScan
from tasks.registration.rigid_motion import Array
from tasks.registration.standpoint import likely_standpoint
from tasks.registration.voxel_grid import Accumulator, unit, voxel_keys, voxel_sums

Floats = npt.NDArray[np.float32]
NEIGHBOURS = 20  # of a normal
COARSE_POINTS = 4000  # about as many, at equal density, carry the shape of a site
ON_A_SURFACE = 2  # points in a coarse voxel: one alone is dust, rain, or the edge of sight
SPACING_POINTS = 50_000  # of a cloud tell its spacing
ALONE = 3.0  # times the usual distance to a neighbour
FILLED = 4  # points in a coarse voxel on average; fewer are no surface any more
WORTH_THREADS = 8000  # queries; for fewer, starting threads takes longer than it saves


@dataclass(frozen=True)
class Cloud:
    points_m: Floats  # (N, 3) in the scan's frame
    normals: Floats  # (N, 3) unit, towards the scanner once `turned`

    def __len__(self) -> int:
        return len(self.points_m)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points_m, balanced_tree=False, compact_nodes=False)

    def nearest(
        self, points_m: npt.NDArray[np.floating], reach_m: float
    ) -> tuple[Array, npt.NDArray[np.int64]]:
        """(N,) distance to the nearest point and its number; infinity where none is within reach."""
        workers = -1 if len(points_m) > WORTH_THREADS else 1
        distance_m, at = self._tree.query(points_m, distance_upper_bound=reach_m, workers=workers)
        return distance_m, at

    @property
    def spacing_m(self) -> float:
        """Median distance of a point to the one nearest to it."""
        return float(np.median(self.gaps_m(self.points_m[:: max(1, len(self) // 2000)], 1)))

    def gaps_m(self, own_m: Floats, neighbour: int) -> Array:
        """(N,) distance of some of the cloud's own points to their first, second, … neighbour."""
        return np.asarray(self._tree.query(own_m, k=[neighbour + 1])[0][:, 0])

    def taken(self, chosen: npt.NDArray[np.int64]) -> "Cloud":
        return Cloud(self.points_m[chosen], self.normals[chosen])


def fine_cloud(blocks: Iterable[LoadedScan], voxel_m: float) -> tuple[Cloud, LoadedScan, int]:
    """The scan at one point per voxel, its first block, its number of points. Normals are the file's, else
    those of the plane through the neighbours, of either sign, and the block's are None. No more of the scan
    than a block is in memory."""
    first: LoadedScan | None = None
    total = Accumulator()
    points = 0
    for block in blocks:
        first = first or block
        points += len(block.points_m)
        values = block.points_m
        if first.normals is not None:
            none = np.zeros_like(values)
            values = np.hstack([values, none if block.normals is None else block.normals])
        total.add(voxel_sums(voxel_keys(block.points_m, voxel_m), values))
    assert first is not None, "a scan has at least one block"
    means = total.total().means
    points_m, stated = means[:, :3], unit(means[:, 3:])
    if stated.any(axis=1).mean() > 0.99:
        normals = stated
    else:
        normals, first = estimated_normals(points_m), replace(first, normals=None)
    return Cloud(points_m.astype(np.float32), normals.astype(np.float32)), first, points


def turned(cloud: Cloud, scanner_m: Array | None) -> Cloud:
    """The cloud with its normals to the scanner; where it is not known, to where it likely stood or, in a
    cloud of several scanners, to the open side."""
    points_m, normals = cloud.points_m.astype(np.float64), cloud.normals.astype(np.float64)
    place_m = likely_standpoint(points_m) if scanner_m is None else scanner_m
    if place_m is None:
        return Cloud(cloud.points_m, to_open_side(points_m, normals).astype(np.float32))
    return Cloud(cloud.points_m, np.where(away_from(place_m, cloud)[:, None], -cloud.normals, cloud.normals))


def away_from(place_m: Array, cloud: Cloud) -> npt.NDArray[np.bool_]:
    """(N,) true for the points whose normals turn away from a (3,) place."""
    return np.asarray(np.einsum("ij,ij->i", cloud.normals, place_m - cloud.points_m) < 0)


def estimated_normals(points_m: Array) -> Array:
    """(N, 3) unit normals of either sign. A point without enough neighbours gets z."""
    cloud = small_gicp.PointCloud(points_m)
    small_gicp.estimate_normals(cloud, num_neighbors=min(NEIGHBOURS, len(points_m)), num_threads=1)
    normals = np.array(cloud.normals())[:, :3]
    normals[~(np.abs(np.linalg.norm(normals, axis=1) - 1) < 1e-3)] = [0.0, 0.0, 1.0]
    return normals


def coarse_voxel_m(cloud: Cloud, scanner_m: Array | None) -> float:
    """The spacing at which the cloud keeps about COARSE_POINTS points, and each stands for several. Points
    that have no neighbours where the scanner's steps would have put some do not count."""
    some = cloud.taken(np.arange(0, len(cloud), max(1, len(cloud) // SPACING_POINTS)))
    points_m = some.points_m[~_alone(some, scanner_m)]
    voxel_m = 0.05
    while voxel_m < 5.0:
        counts = np.unique(voxel_keys(points_m, voxel_m), return_counts=True)[1]
        shared = counts[counts >= ON_A_SURFACE]
        if len(counts) <= COARSE_POINTS and shared.sum() >= FILLED * len(shared) > 0:
            break
        voxel_m *= 1.25
    return voxel_m


def _alone(cloud: Cloud, scanner_m: Array | None) -> npt.NDArray[np.bool_]:
    """(N,) points (dust, rain) whose second neighbour is ALONE times as far as is usual, by distance and, as
    scanners step by angles, by distance over range."""
    from_m = np.median(cloud.points_m, axis=0) if scanner_m is None else scanner_m
    range_m = np.maximum(np.linalg.norm(cloud.points_m - from_m, axis=1), 1.0)
    gap_m = cloud.gaps_m(cloud.points_m, 2)
    usual_m = np.maximum(np.median(gap_m), np.median(gap_m / range_m) * range_m)
    return np.asarray(gap_m > ALONE * usual_m)


def on_surfaces(fine: Cloud, voxel_m: float) -> Cloud:
    """The cloud without its lone echoes: points that have a coarse voxel to themselves."""
    _, voxel, counts = np.unique(voxel_keys(fine.points_m, voxel_m), return_inverse=True, return_counts=True)
    return fine.taken(np.flatnonzero(counts[voxel] >= ON_A_SURFACE))


def coarse_cloud(fine: Cloud, voxel_m: float) -> Cloud:
    """Voxel means of points and normals; opposite faces of a thin part do not mix."""
    keys = voxel_keys(fine.points_m, voxel_m, facing(fine.normals))
    means = voxel_sums(keys, np.hstack([fine.points_m, fine.normals])).means
    return Cloud(means[:, :3].astype(np.float32), unit(means[:, 3:]).astype(np.float32))


def facing(normals: npt.NDArray[np.floating]) -> npt.NDArray[np.int64]:
    """(N,) 0…5: which of ±x, ±y, ±z a normal is nearest to."""
    axis = np.abs(normals).argmax(axis=1)
    return np.asarray(2 * axis + (normals[np.arange(len(normals)), axis] < 0), dtype=np.int64)


def balanced_sample(cloud: Cloud, count: int, seed: int) -> Cloud:
    """At most `count` points with all facings in equal numbers as far as there are (normal-space sampling,
    Rusinkiewicz and Levoy 2001): a large floor does not drown the walls that fix the rest."""
    if len(cloud) <= count:
        return cloud
    order = np.random.default_rng(seed).permutation(len(cloud))
    group = facing(cloud.normals[order])
    rank = np.empty(len(order), dtype=np.int64)  # of each point among those of its facing
    for value in range(6):
        of_group = np.flatnonzero(group == value)
        rank[of_group] = np.arange(len(of_group))
    chosen = order[np.lexsort((group, rank))[:count]]
    return cloud.taken(np.sort(chosen))
