"""A station made ready for registration: its cloud at equal density with normals, at two resolutions."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import small_gicp
from scipy.spatial import cKDTree

from tasks.registration.read_scan import LoadedScan
from tasks.registration.rigid_motion import Array
from tasks.registration.voxel_grid import Accumulator, unit, voxel_keys, voxel_sums

Floats = npt.NDArray[np.float32]
NEIGHBOURS = 20  # of a normal
COARSE_POINTS = 4000  # about as many, at equal density, carry the shape of a site
WORTH_THREADS = 8000  # queries; for fewer, starting threads takes longer than it saves
FROM_ABOVE_M = 1000.0  # where a scanner is not known, normals point up


@dataclass(frozen=True)
class Cloud:
    points_m: Floats  # (N, 3) in the scan's frame
    normals: Floats  # (N, 3) unit, towards the scanner

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

    def taken(self, chosen: npt.NDArray[np.int64]) -> "Cloud":
        return Cloud(self.points_m[chosen], self.normals[chosen])


def fine_cloud(blocks: Iterable[LoadedScan], voxel_m: float) -> tuple[Cloud, LoadedScan, int]:
    """The scan at one point per voxel, its first block, its number of points. Normals are the file's, else
    those of the plane through the neighbours. No more of the scan than a block is in memory."""
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
        normals = _towards(estimated_normals(points_m), points_m, first.viewpoint_m)
    return Cloud(points_m.astype(np.float32), normals.astype(np.float32)), first, points


def _towards(normals: Array, points_m: Array, scanner_m: Array | None) -> Array:
    """(N, 3) the normals turned to the scanner, upwards where it is not known."""
    if scanner_m is None:
        scanner_m = points_m.mean(axis=0) + np.array([0.0, 0.0, FROM_ABOVE_M])
    away = np.einsum("ij,ij->i", normals, scanner_m - points_m) < 0
    normals[away] *= -1
    return normals


def estimated_normals(points_m: Array) -> Array:
    """(N, 3) unit normals of either sign. A point without enough neighbours gets z."""
    cloud = small_gicp.PointCloud(points_m)
    small_gicp.estimate_normals(cloud, num_neighbors=min(NEIGHBOURS, len(points_m)), num_threads=1)
    normals = np.array(cloud.normals())[:, :3]
    normals[~(np.abs(np.linalg.norm(normals, axis=1) - 1) < 1e-3)] = [0.0, 0.0, 1.0]
    return normals


def coarse_voxel_m(cloud: Cloud) -> float:
    """The spacing at which the cloud keeps about COARSE_POINTS points."""
    some = cloud.points_m[:: max(1, len(cloud) // 50_000)]
    voxel_m = 0.05
    while voxel_m < 5.0 and len(np.unique(voxel_keys(some, voxel_m))) > COARSE_POINTS:
        voxel_m *= 1.25
    return voxel_m


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
