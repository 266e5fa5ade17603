"""How high the ground lies under every place, also where no scanner saw it."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

Array = npt.NDArray[np.float64]

CELL_M = 1.0
WIDEST_OBJECT_M = 25.0  # a deck under which nothing was scanned must not pass for ground


@dataclass(frozen=True)
class Ground:
    """Raster of ground heights; column (i, j) spans x from low_m[0] + i·CELL_M, y likewise."""

    low_m: Array  # (2,)
    height_m: Array  # (nx, ny)
    lowest_m: Array  # (nx, ny) lowest scanned point of the column, inf where there is none

    def _column(self, xy_m: npt.ArrayLike) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        index = np.floor((np.asarray(xy_m, dtype=float) - self.low_m) / CELL_M).astype(np.int64)
        nx, ny = self.height_m.shape
        return np.clip(index[..., 0], 0, nx - 1), np.clip(index[..., 1], 0, ny - 1)

    def at(self, xy_m: npt.ArrayLike) -> Array:
        """(N,) ground heights of (N, 2) or (N, 3) places; outside the scan those of its nearest border."""
        return np.asarray(self.height_m[self._column(np.asarray(xy_m, dtype=float)[..., :2])])

    def places_m(self) -> tuple[Array, npt.NDArray[np.bool_]]:
        """(M, 3) middle of every column at ground height, and whether its ground was scanned."""
        nx, ny = self.height_m.shape
        i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
        xy = self.low_m + (np.stack([i, j], axis=-1).reshape(-1, 2) + 0.5) * CELL_M
        scanned = (self.lowest_m - self.height_m < 0.3).ravel()
        return np.column_stack([xy, self.height_m.ravel()]), scanned


def ground_under(points_m: Array, water_m: float | None = None) -> Ground:
    """Ground of (N, 3) points: the lowest point of each column, opened (erosion, then dilation) so that
    whatever is narrower than 25 m and stands higher than its surroundings drops out. It never lies above
    the lowest point of a column, so nothing scanned as free air is taken for ground, but never below the
    water's level where one is given: water returns no echo."""
    low = points_m[:, :2].min(axis=0)
    shape = np.floor((points_m[:, :2].max(axis=0) - low) / CELL_M).astype(int) + 1
    column = np.floor((points_m[:, :2] - low) / CELL_M).astype(int)
    lowest = np.full(shape, np.inf)
    np.minimum.at(lowest, (column[:, 0], column[:, 1]), points_m[:, 2])
    nearest = ndimage.distance_transform_edt(np.isinf(lowest), return_distances=False, return_indices=True)
    filled = lowest[tuple(nearest)]
    opened = ndimage.grey_opening(filled, size=int(WIDEST_OBJECT_M / CELL_M), mode="nearest")
    height = np.minimum(opened, filled)
    return Ground(low, height if water_m is None else np.maximum(height, water_m), lowest)
