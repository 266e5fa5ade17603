"""A* over the occupancy grid with the paper's cost C(k, l, m) = a1·k² + a2·l² + a3·m², k, l, m ∈ {−1, 0, 1}.

With such steps the cost is a weighted Manhattan distance, so Σ a·|d| is an admissible and consistent
heuristic and ties are many: among paths of equal cost the one of least Euclidean length is taken. A step may
not cut a corner: every voxel of the box that it crosses must be free.
"""

from itertools import product

import numpy as np
import numpy.typing as npt
from numba import njit

Cell = tuple[int, int, int]
Cells = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]

STEPS: Cells = np.array([s for s in product((-1, 0, 1), repeat=3) if any(s)])  # (26, 3): k, l, m
SAME = 1e-9  # costs closer than this are a tie: sums of the same steps in another order


class PathFinder:
    """Searches on one grid, its tables kept from search to search. free: (nx, ny, nz) bool."""

    def __init__(self, free: Flags, weights: tuple[float, float, float]) -> None:
        padded = np.pad(free, 1)  # a border that is not free spares the search every test for the grid's end
        self._free = padded.ravel()
        self._shape = padded.shape
        self._weights = np.array(weights, dtype=float)
        along = np.array([self._shape[1] * self._shape[2], self._shape[2], 1])
        self._offsets = STEPS @ along
        # Whether a step is free: all corners of the box it spans, its own start repeated where it spans less.
        corners = np.array(list(product((0, 1), repeat=3)))
        self._crossed = np.array([(corners * step) @ along for step in STEPS])
        self._step_cost = (STEPS * STEPS) @ self._weights
        self._step_length = np.sqrt((STEPS * STEPS).sum(axis=1))
        self._cost = np.empty(self._free.size, dtype=np.float64)
        self._length = np.empty(self._free.size, dtype=np.float32)
        self._came_by = np.empty(self._free.size, dtype=np.int8)
        self._seen = np.zeros(self._free.size, dtype=np.int32)  # 2n: open in search n, 2n + 1: closed
        self._searches = 0

    def path(self, start: Cell, goal: Cell) -> tuple[Cells, float] | None:
        """Cells (P, 3) from start to goal, both included, and the cost; None where there is no way."""
        first, last = (int(np.ravel_multi_index(np.array(c) + 1, self._shape)) for c in (start, goal))
        if not (self._free[first] and self._free[last]):
            return None
        self._searches += 1
        if not _search(
            self._free, self._shape[1], self._shape[2], first, last, self._weights,
            self._offsets, self._crossed, self._step_cost, self._step_length,
            self._cost, self._length, self._came_by, self._seen, 2 * self._searches,
        ):  # fmt: skip
            return None
        passed = [last]
        while passed[-1] != first:
            passed.append(passed[-1] - int(self._offsets[self._came_by[passed[-1]]]))
        cells = np.column_stack(np.unravel_index(passed[::-1], self._shape)) - 1
        return cells.astype(np.int64), float(self._cost[last])


@njit(cache=True)
def _before(keys, i, j):  # type: ignore[no-untyped-def]
    """Whether heap entry i comes before j: less cost, then less length, then nearer to the goal."""
    if abs(keys[i, 0] - keys[j, 0]) > SAME:
        return keys[i, 0] < keys[j, 0]
    if abs(keys[i, 1] - keys[j, 1]) > 1e-4:
        return keys[i, 1] < keys[j, 1]
    return keys[i, 2] < keys[j, 2]


@njit(cache=True)
def _swap(keys, cells, i, j):  # type: ignore[no-untyped-def]
    for c in range(3):
        key = keys[i, c]
        keys[i, c] = keys[j, c]
        keys[j, c] = key
    cell = cells[i]
    cells[i] = cells[j]
    cells[j] = cell


@njit(cache=True)
def _sift_up(keys, cells, i):  # type: ignore[no-untyped-def]
    while i > 0 and _before(keys, i, (i - 1) // 2):
        _swap(keys, cells, i, (i - 1) // 2)
        i = (i - 1) // 2


@njit(cache=True)
def _sift_down(keys, cells, size):  # type: ignore[no-untyped-def]
    i = 0
    while 2 * i + 1 < size:
        child = 2 * i + 1
        if child + 1 < size and _before(keys, child + 1, child):
            child += 1
        if not _before(keys, child, i):
            return
        _swap(keys, cells, i, child)
        i = child


@njit(cache=True)
def _shortest_length(dx, dy, dz):  # type: ignore[no-untyped-def]
    """Euclidean length of the shortest path of 26-neighbour steps over an empty grid."""
    least = min(dx, dy, dz)
    most = max(dx, dy, dz)
    middle = dx + dy + dz - least - most
    return 1.7320508075688772 * least + 1.4142135623730951 * (middle - least) + (most - middle)


@njit(cache=True)
def _is_free(free, cell, crossed, step):  # type: ignore[no-untyped-def]
    blocked = 0
    for corner in range(8):
        blocked += not free[cell + crossed[step, corner]]
    return blocked == 0


@njit(cache=True)
def _search(  # type: ignore[no-untyped-def]
    free, ny, nz, start, goal, weights, offsets, crossed, step_cost, step_length,
    cost, length, came_by, seen, mark,
):  # fmt: skip
    """Fill cost, length and came_by from start to goal (flat indices); whether goal was reached."""
    keys = np.zeros((1024, 3))
    cells = np.zeros(1024, dtype=np.int64)
    cells[0] = start
    size = 1
    cost[start] = 0.0
    length[start] = 0.0
    seen[start] = mark
    goal_x, goal_y, goal_z = goal // (ny * nz), goal // nz % ny, goal % nz
    while size > 0:
        here = cells[0]
        size -= 1
        _swap(keys, cells, 0, size)
        _sift_down(keys, cells, size)
        if here == goal:
            return True
        if seen[here] == mark + 1:
            continue
        seen[here] = mark + 1
        for step in range(26):
            there = here + offsets[step]
            if not free[there] or seen[there] == mark + 1 or not _is_free(free, here, crossed, step):
                continue
            new_cost = cost[here] + step_cost[step]
            new_length = length[here] + step_length[step]
            if seen[there] == mark and (
                new_cost > cost[there] + SAME
                or (new_cost > cost[there] - SAME and new_length > length[there] - 1e-4)
            ):
                continue
            seen[there] = mark
            cost[there] = new_cost
            length[there] = new_length
            came_by[there] = step
            dx = abs(goal_x - there // (ny * nz))
            dy = abs(goal_y - there // nz % ny)
            dz = abs(goal_z - there % nz)
            to_go = dx * weights[0] + dy * weights[1] + dz * weights[2]
            if size == len(cells):
                more_keys = np.zeros((2 * size, 3))
                more_cells = np.zeros(2 * size, dtype=np.int64)
                for i in range(size):
                    more_cells[i] = cells[i]
                    for c in range(3):
                        more_keys[i, c] = keys[i, c]
                keys = more_keys
                cells = more_cells
            keys[size, 0] = new_cost + to_go
            keys[size, 1] = new_length + _shortest_length(dx, dy, dz)
            keys[size, 2] = to_go
            cells[size] = there
            size += 1
            _sift_up(keys, cells, size - 1)
    return False
