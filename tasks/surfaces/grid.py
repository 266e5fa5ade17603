"""A sparse grid of cells over a cloud: which points a cell holds, which cells lie around it."""

import numpy as np
import numpy.typing as npt

from tasks.surfaces.cloud import Floats, Indices

Links = npt.NDArray[np.int32]


class Grid:
    """order: (N,) indices of the points, cell after cell; cell c holds order[start[c]:start[c + 1]].
    cell: (N,) cell of each point in that order. neighbours: (C, K) cells up to `reach` steps away on each
    axis, −1 where there is none."""

    def __init__(self, points_m: Floats, cell_m: float, reach: int = 1) -> None:
        cells = np.floor(points_m / cell_m).astype(np.int64)
        cells -= cells.min(axis=0) - reach  # a margin, so that no neighbour wraps into the next row
        shape = cells.max(axis=0) + 1 + reach
        strides = np.array([shape[1] * shape[2], shape[2], 1])
        keys = (cells * strides).sum(axis=1)
        self.order: Indices = np.argsort(keys, kind="stable")
        occupied, first = np.unique(keys[self.order], return_index=True)
        self.start: Indices = np.append(first, len(keys))
        self.cell: Indices = np.repeat(np.arange(len(occupied)), np.diff(self.start))
        steps = np.arange(-reach, reach + 1)
        offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        offsets = offsets[np.any(offsets != 0, axis=1)]
        self.neighbours: Links = np.empty((len(occupied), len(offsets)), dtype=np.int32)
        for column, offset in enumerate((offsets * strides).sum(axis=1)):
            found = np.minimum(np.searchsorted(occupied, occupied + offset), len(occupied) - 1)
            self.neighbours[:, column] = np.where(occupied[found] == occupied + offset, found, -1)
