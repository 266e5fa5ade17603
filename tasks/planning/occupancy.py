"""The occupancy grid (paper, section 2.3): voxels that the vehicle's centre may or may not enter."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from tasks.planning.airspace import Airspace

Array = npt.NDArray[np.float64]
Cells = npt.NDArray[np.int64]

REACH = 4  # voxels around a place that it may be entered from
MOST_CELLS = 80_000_000  # bounds memory: 5 bytes a cell
SLAB_CELLS = 4_000_000  # decided at a time, at about 30 bytes a cell


@dataclass(frozen=True)
class VoxelGrid:
    """free[i, j, k] says that the whole ball around the voxel at low_m + (i, j, k)·voxel_m that reaches its
    corners is free, so a straight step between two free neighbours keeps the inflation everywhere."""

    low_m: Array  # (3,) centre of voxel (0, 0, 0)
    voxel_m: float
    free: npt.NDArray[np.bool_]
    component: npt.NDArray[np.int32]  # connected free space by number, 0 where not free

    def cells(self, places_m: npt.ArrayLike) -> Cells:
        """(M, 3) voxel of each place, clipped to the grid."""
        index = np.rint((np.atleast_2d(places_m) - self.low_m) / self.voxel_m).astype(np.int64)
        return np.asarray(np.clip(index, 0, np.array(self.free.shape) - 1))

    def centres_m(self, cells: npt.ArrayLike) -> Array:
        return np.asarray(self.low_m + np.asarray(cells) * self.voxel_m)

    def entrance(self, place_m: Array, airspace: Airspace) -> tuple[int, int, int] | None:
        """The nearest free voxel that a straight flight from a free place reaches, or None. Near a surface
        a place may be free while its voxel is not, since a voxel answers for all of its volume."""
        (cell,) = self.cells(place_m)
        low = np.maximum(cell - REACH, 0)
        block = self.free[tuple(slice(a, b) for a, b in zip(low, cell + REACH + 1, strict=True))]
        cells = np.argwhere(block) + low
        if not len(cells):
            return None
        order = np.argsort(((self.centres_m(cells) - place_m) ** 2).sum(axis=1), kind="stable")
        for nearest in (cells[order[:3]], *(cells[order[k : k + 32]] for k in range(3, len(order), 32))):
            centres = self.centres_m(nearest)
            free = airspace.segments_free(np.broadcast_to(place_m, centres.shape), centres)
            if free.any():
                i, j, k = nearest[int(np.argmax(free))]
                return int(i), int(j), int(k)
        return None


def voxel_grid(airspace: Airspace, low_m: Array, high_m: Array, voxel_m: float) -> VoxelGrid:
    """Grid over the box from low_m to high_m. Voxels grow beyond `voxel_m` where there would be too many.
    Decided a slab at a time: what is far from a slab cannot make it less free."""
    extent = high_m - low_m
    voxel_m = max(voxel_m, float(np.cbrt(extent.prod() / MOST_CELLS)))
    shape = np.ceil(extent / voxel_m).astype(int) + 1
    free = np.empty(shape, dtype=bool)
    order = np.argsort(airspace.points_m[:, 0], kind="stable")
    points_m = airspace.points_m[order]
    planes = max(1, SLAB_CELLS // int(shape[1] * shape[2]))
    for first in range(0, int(shape[0]), planes):
        low = low_m + np.array([first * voxel_m, 0.0, 0.0])
        slab = np.array([min(planes, int(shape[0]) - first), shape[1], shape[2]])
        free[first : first + planes] = _far_enough(airspace, points_m, low, slab, voxel_m)
    xy = np.stack(np.meshgrid(*(low_m[a] + np.arange(shape[a]) * voxel_m for a in (0, 1)), indexing="ij"), -1)
    ground_m = airspace.ground.at(xy)
    height_m = low_m[2] + np.arange(shape[2]) * voxel_m
    columns = np.stack(np.meshgrid(*(np.arange(n) for n in shape[1:]), indexing="ij"), -1).reshape(-1, 2)
    for i in range(shape[0]):  # plane by plane: a place a cell takes a hundred bytes
        altitude = height_m - ground_m[i][:, None]
        free[i] &= (altitude >= airspace.min_altitude_m + voxel_m / 2) & (altitude <= airspace.max_altitude_m)
        if airspace.allowed is not None:
            places = low_m + np.column_stack([np.full(len(columns), i), columns]) * voxel_m
            slack_m = airspace.allowed.slack_m(places)
            free[i] &= (slack_m >= np.sqrt(3) / 2 * voxel_m).reshape(shape[1:])
    component, _ = ndimage.label(free)  # face neighbours: a step that cuts no corner leaves none of them
    return VoxelGrid(low_m=low_m, voxel_m=voxel_m, free=free, component=component)


def _far_enough(
    airspace: Airspace, points_m: Array, low_m: Array, shape: Cells, voxel_m: float
) -> npt.NDArray[np.bool_]:
    """Of a slab of voxels from low_m on, whose whole ball is farther than the inflation from every point.
    points_m: the airspace's, sorted by x."""
    half_diagonal = np.sqrt(3) / 2 * voxel_m
    needed = airspace.inflation_m + half_diagonal
    pad = int(np.ceil((needed + half_diagonal) / voxel_m)) + 1  # points just outside the slab count too
    reach, high_m = pad * voxel_m, low_m + (shape - 1) * voxel_m
    here = slice(*np.searchsorted(points_m[:, 0], [low_m[0] - reach, high_m[0] + reach]))
    near = points_m[here]
    near = near[np.all((near > low_m - reach) & (near < high_m + reach), axis=1)]
    if not len(near):
        return np.ones(shape, dtype=bool)
    occupied = np.zeros(shape + 2 * pad, dtype=bool)
    occupied[tuple((np.rint((near - low_m) / voxel_m).astype(int) + pad).T)] = True
    # Between voxel centres the distance is known within half a diagonal; only that shell is asked exactly.
    distance = ndimage.distance_transform_edt(~occupied)[(slice(pad, -pad),) * 3] * voxel_m
    free = np.asarray(distance >= needed + half_diagonal)
    shell = np.argwhere(~free & (distance >= needed - half_diagonal))
    if len(shell):
        exact = airspace.distance_m(low_m + shell * voxel_m, needed) >= needed
        free[tuple(shell[exact].T)] = True
    return free
