"""The occupancy grid (paper, section 2.3): voxels that the vehicle's centre may or may not enter."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from tasks.planning.airspace import Airspace

Array = npt.NDArray[np.float64]
Cells = npt.NDArray[np.int64]

REACH = 4  # voxels around a place that it may be entered from
MOST_CELLS = 16_000_000  # bounds memory: about 20 bytes a cell while the grid is built


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
    """Grid over the box from low_m to high_m. Voxels grow beyond `voxel_m` where there would be too many."""
    extent = high_m - low_m
    voxel_m = max(voxel_m, float(np.cbrt(extent.prod() / MOST_CELLS)))
    shape = np.ceil(extent / voxel_m).astype(int) + 1
    half_diagonal = np.sqrt(3) / 2 * voxel_m
    needed = airspace.inflation_m + half_diagonal

    points = airspace.points_m
    reach = needed + voxel_m
    near = np.all((points > low_m - reach) & (points < high_m + reach), axis=1)
    pad = int(np.ceil(reach / voxel_m)) + 1  # points just outside the box count too
    occupied = np.zeros(shape + 2 * pad, dtype=bool)
    cell = np.rint((points[near] - low_m) / voxel_m).astype(int) + pad
    occupied[tuple(cell.T)] = True

    # Between voxel centres the distance is known within half a diagonal; only that shell is asked exactly.
    inner = (slice(pad, -pad),) * 3
    distance = np.full(shape, np.inf)
    if near.any():
        distance = ndimage.distance_transform_edt(~occupied)[inner] * voxel_m
    free = distance >= needed + half_diagonal
    shell = np.argwhere(~free & (distance >= needed - half_diagonal))
    if len(shell):
        exact = airspace.distance_m(low_m + shell * voxel_m, needed) >= needed
        free[tuple(shell[exact].T)] = True

    xy = np.stack(np.meshgrid(*(low_m[a] + np.arange(shape[a]) * voxel_m for a in (0, 1)), indexing="ij"), -1)
    altitude = (low_m[2] + np.arange(shape[2]) * voxel_m) - airspace.ground.at(xy)[..., None]
    free &= (altitude >= airspace.min_altitude_m + voxel_m / 2) & (altitude <= airspace.max_altitude_m)
    if airspace.allowed is not None:
        for i in range(shape[0]):  # plane by plane: a place a cell takes a hundred bytes
            columns = np.stack(np.meshgrid(*(np.arange(n) for n in shape[1:]), indexing="ij"), -1).reshape(
                -1, 2
            )
            places = low_m + np.column_stack([np.full(len(columns), i), columns]) * voxel_m
            free[i] &= (airspace.allowed.slack_m(places) >= half_diagonal).reshape(shape[1:])
    component, _ = ndimage.label(free)  # face neighbours: a step that cuts no corner leaves none of them
    return VoxelGrid(low_m=low_m, voxel_m=voxel_m, free=free, component=component)
