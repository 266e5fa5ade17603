"""The order in which shooting points are visited: a closed tour from home, short in time.

The paper leaves the order open. Rows flown to and fro (boustrophedon) and nearest neighbour give the starts;
2-opt (reverse a stretch) and Or-opt (move up to three neighbours elsewhere) improve both until neither helps.
"""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from tasks.planning.viewpoints import View

Array = npt.NDArray[np.float64]
Order = npt.NDArray[np.int64]

BLOCK = 800  # points improved together: the cost table grows with its square
LEAST_GAIN = 1e-9  # less is rounding, and would never end


def to_and_fro(views: Sequence[View]) -> Order:
    """Indices of the views, surface by surface, along the longer side of each grid, every other line back."""
    order: list[int] = []
    for surface in dict.fromkeys(v.surface for v in views):
        own = [i for i, v in enumerate(views) if v.surface == surface]
        along_rows = len({views[i].column for i in own}) >= len({views[i].row for i in own})
        line = {i: (views[i].row if along_rows else views[i].column) for i in own}
        place = {i: (views[i].column if along_rows else views[i].row) for i in own}
        back = {number: k % 2 for k, number in enumerate(sorted(set(line.values())))}
        order += sorted(own, key=lambda i: (line[i], -place[i] if back[line[i]] else place[i]))
    return np.array(order, dtype=np.int64)


def nearest_neighbour(cost: Array) -> Order:
    """Order (N,) that starts at 0 and always goes on to the cheapest point not yet visited."""
    left = cost.copy()
    left[:, 0] = np.inf
    order = [0]
    while len(order) < len(cost):
        order.append(int(np.argmin(left[order[-1]])))
        left[:, order[-1]] = np.inf
    return np.array(order, dtype=np.int64)


def visiting_order(start: Order, cost_between: Callable[[Order], Array]) -> Order:
    """A short closed tour through the points 0..N, 0 being home, which stays first.

    start: (N + 1,) an order to begin from. cost_between gives the symmetric (M, M) table of some points.
    Up to 800 points are ordered as one; more are improved stretch by stretch along `start`.
    """
    if len(start) <= BLOCK:
        cost = cost_between(np.arange(len(start)))
        starts = [start, nearest_neighbour(cost)]
        return min((improved(s, cost, closed=True) for s in starts), key=lambda o: tour_cost(o, cost))
    order = start.copy()
    for low in range(0, len(order) - 1, BLOCK // 2):
        block = order[low : low + BLOCK]
        stretch = improved(np.arange(len(block)), cost_between(block), closed=False)
        order[low : low + BLOCK] = block[stretch]
    return order


def tour_cost(order: Order, cost: Array) -> float:
    """Cost of the closed tour."""
    return float(cost[order, np.roll(order, -1)].sum())


def improved(order: Order, cost: Array, closed: bool) -> Order:
    """2-opt and Or-opt until neither helps. The first point stays first; of an open stretch the last too."""
    nodes = np.append(order, order[0]) if closed else order.copy()
    _improve(nodes, np.ascontiguousarray(cost))
    return np.asarray(nodes[:-1] if closed else nodes)


@njit(cache=True)
def _reverse(order, i, j):  # type: ignore[no-untyped-def]
    """Turn order[i..j], both ends included."""
    while i < j:
        node = order[i]
        order[i] = order[j]
        order[j] = node
        i += 1
        j -= 1


@njit(cache=True)
def _improve(order, cost):  # type: ignore[no-untyped-def]
    """Improve, in place, the inner points of an open path between its fixed first and last."""
    n = len(order)
    better = True
    while better:
        better = False
        for i in range(1, n - 2):
            for j in range(i + 1, n - 1):
                kept = cost[order[i - 1], order[j]] + cost[order[i], order[j + 1]]
                if cost[order[i - 1], order[i]] + cost[order[j], order[j + 1]] - kept > LEAST_GAIN:
                    _reverse(order, i, j)
                    better = True
        for size in range(1, 4):
            for i in range(1, n - size):
                if _move(order, cost, i, i + size - 1):
                    better = True


@njit(cache=True)
def _move(order, cost, i, j):  # type: ignore[no-untyped-def]
    """Move the stretch order[i..j] to where it saves most, either way round; whether it moved."""
    first, last = order[i], order[j]
    saved = cost[order[i - 1], first] + cost[last, order[j + 1]] - cost[order[i - 1], order[j + 1]]
    best, at, turned = LEAST_GAIN, -1, False
    for k in range(len(order) - 1):  # between order[k] and order[k + 1]
        if k < i - 1 or k > j:
            a, b = order[k], order[k + 1]
            ahead = saved + cost[a, b] - cost[a, first] - cost[last, b]
            back = saved + cost[a, b] - cost[a, last] - cost[first, b]
            if max(ahead, back) > best:
                best, at, turned = max(ahead, back), k, back > ahead
    if at < 0:
        return False
    # Two neighbouring stretches change places by turning both as one, then each.
    size = j - i + 1
    if at > j:
        _reverse(order, i, at)
        _reverse(order, i, at - size)
        moved = at - size + 1
    else:
        _reverse(order, at + 1, j)
        _reverse(order, at + 1 + size, j)
        moved = at + 1
    if not turned:
        _reverse(order, moved, moved + size - 1)
    return True
