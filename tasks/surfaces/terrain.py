"""The ground: it bounds the flight and carries the structure, but is rough and nothing to inspect.

Searched for planes it falls apart into dozens, so it is found first, as terrain: the lowest points seen from
above, cell by cell, joined where the height steps by less than a kerb. What has something below it (a deck,
a table) is no ground. Steep ground is left to the plane search (ground.py names it).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tasks.surfaces.cloud import Cloud, Floats, Indices, Mask

CELL_M = 1.0
MOST_CELLS = 4000  # along a side; larger sites get larger cells
RANK = 2  # of the height that counts as the lowest: two stray points below do not matter
ROUGH_M = 0.2  # grass, gravel, a kerb, a slope of one in five
STEP_M = 0.3  # to the next cell
UNDERCUT = 0.3  # cells with something lower below or beside them that a ground may have, per border cell
LEVEL_COSINE = float(np.cos(np.radians(35.0)))  # of normals, roughness included
SMALLEST = 10.0  # in smallest surfaces
BESIDE_CELLS = 10  # beyond its outline ground goes on, where the scan is too thin to show it,
BESIDE_SLOPE = 0.05  # rising or falling by this much


@dataclass(frozen=True)
class Terrain:
    """height_m: (rows, columns) of the nearest ground cell; rough_m: how far a point of the ground may be
    from it, −inf where no ground is near. pieces: indices of the points of each connected ground."""

    corner_m: Floats  # (2,) x, y
    cell_m: float
    height_m: Floats
    rough_m: Floats
    pieces: list[Indices]

    def carries(self, points_m: Floats) -> Mask:
        """(N,) which points are ground: within its roughness."""
        cell = np.floor((points_m[:, :2] - self.corner_m) / self.cell_m).astype(np.int64)
        column, row = np.clip(cell, 0, np.array(self.height_m.shape)[::-1] - 1).T
        return np.asarray(np.abs(points_m[:, 2] - self.height_m[row, column]) <= self.rough_m[row, column])


def find_terrain(cloud: Cloud, smallest_m2: float) -> Terrain:
    """Connected pieces of ground of at least SMALLEST·smallest_m2, and the heights they tell of."""
    corner_m = cloud.points[:, :2].min(axis=0)
    size_m = np.ptp(cloud.points[:, :2], axis=0)
    cell_m = max(CELL_M, float(size_m.max()) / MOST_CELLS)
    columns, rows = (int(count) + 1 for count in size_m // cell_m)
    column, row = np.floor((cloud.points[:, :2] - corner_m) / cell_m).astype(np.int64).T
    cell = row * columns + column
    level = (np.abs(cloud.normals[:, 2]) >= LEVEL_COSINE) & (cloud.views[:, 2] > 0)
    height_m = _lowest(cell[level], cloud.points[level, 2], (rows, columns))
    lowest_m = _lowest(cell, cloud.points[:, 2], (rows, columns))

    around_m = ndimage.minimum_filter(lowest_m, size=3, mode="constant", cval=np.inf)
    undercut = around_m < height_m - STEP_M
    labels = _steps_joined(height_m)
    pieces = []
    ground = np.zeros(height_m.shape, dtype=bool)
    lies = level if cloud.sides_known else np.abs(cloud.normals[:, 2]) >= LEVEL_COSINE  # whatever its sign
    on_it = lies & (cloud.points[:, 2] <= height_m.ravel()[cell] + ROUGH_M)
    cells = np.bincount(labels[labels >= 0])
    for label in np.flatnonzero(cells * cell_m**2 >= SMALLEST * smallest_m2):
        own = labels == label
        border = own & ~ndimage.binary_erosion(own, structure=np.ones((3, 3)))
        if undercut[own].sum() <= UNDERCUT * border.sum():
            ground |= own
            pieces.append(np.flatnonzero(on_it & own.ravel()[cell]))
    if not pieces:
        return Terrain(corner_m, cell_m, height_m, np.full(height_m.shape, -np.inf), [])
    away, nearest = ndimage.distance_transform_edt(~ground, return_indices=True)
    rough_m = np.where(away <= BESIDE_CELLS, ROUGH_M + BESIDE_SLOPE * away * cell_m, -np.inf)
    return Terrain(corner_m, cell_m, height_m[tuple(nearest)], rough_m, pieces)


def _lowest(cell: Indices, z_m: Floats, shape: tuple[int, int]) -> Floats:
    """The RANK-lowest height in each cell; +inf where there is none."""
    order = np.lexsort((z_m, cell))
    occupied, start, count = np.unique(cell[order], return_index=True, return_counts=True)
    lowest = np.full(shape[0] * shape[1], np.inf)
    lowest[occupied] = z_m[order[start + np.minimum(RANK, count - 1)]]
    return lowest.reshape(shape)


def _steps_joined(height_m: Floats) -> npt.NDArray[np.int64]:
    """(rows, columns) labels 0, 1, … of cells joined over steps below STEP_M; −1 where there is no height."""
    known = np.isfinite(height_m)
    number = np.cumsum(known.ravel()).reshape(height_m.shape) - 1
    edges = []
    for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = np.s_[: height_m.shape[0] - dr, max(0, -dc) : height_m.shape[1] - max(0, dc)]
        b = np.s_[dr:, max(0, dc) : height_m.shape[1] + min(0, dc)]
        both = known[a] & known[b]
        joined = np.zeros(both.shape, dtype=bool)
        joined[both] = np.abs(height_m[a][both] - height_m[b][both]) <= STEP_M
        edges.append(np.column_stack([number[a][joined], number[b][joined]]))
    pairs = np.concatenate(edges)
    total = int(known.sum())
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(total, total))
    labels = np.full(height_m.shape, -1, dtype=np.int64)
    labels[known] = connected_components(graph, directed=False)[1]
    return labels
