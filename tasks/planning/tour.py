"""The order in which shooting points are visited: a closed tour from home, short in time.

The paper leaves the order open. Rows flown to and fro (boustrophedon) and nearest neighbour give the starts;
2-opt (reverse a stretch) and Or-opt (move up to three neighbours elsewhere) improve both until neither helps.
Then the better one is kicked out of its local optimum over and over (iterated local search): a double bridge
among neighbouring stops, 2-opt and Or-opt around it, kept where the tour got no longer. The kicks are seeded.
"""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from tasks.planning.viewpoints import View

Array = npt.NDArray[np.float64]
Order = npt.NDArray[np.int64]

BLOCK = 800  # points improved together: the cost table grows with its square
KICKS = 40  # a stop
NEAR = 10  # neighbours that a stop may be joined to
KICKED = 30  # stops along the tour that a double bridge may span
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
        starts = [improved(s, cost, closed=True) for s in (start, nearest_neighbour(cost))]
        return kicked(min(starts, key=lambda o: tour_cost(o, cost)), cost, closed=True)
    order = start.copy()
    for low in range(0, len(order) - 1, BLOCK // 2):
        block = order[low : low + BLOCK]
        cost = cost_between(block)
        stretch = kicked(improved(np.arange(len(block)), cost, closed=False), cost, closed=False)
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


def kicked(order: Order, cost: Array, closed: bool, seed: int = 0) -> Order:
    """An order that is never longer: iterated local search from one that is locally best."""
    if len(order) < 8:
        return order
    table = np.ascontiguousarray(cost)
    near = np.argsort(table + np.diag(np.full(len(table), np.inf)), axis=1, kind="stable")[:, :NEAR]
    if closed:  # home is its own double at the end, so that it stays first
        nodes = np.append(order, len(order))
        table = np.pad(table, ((0, 1), (0, 1)), mode="edge")
        table[-1, :-1], table[:-1, -1], table[-1, -1] = cost[order[0]], cost[:, order[0]], 0.0
        near = np.vstack([near, near[order[0]]])
    else:
        nodes = order.copy()
    rng = np.random.default_rng([seed, 0x746F7572])
    cuts = rng.random((KICKS * len(nodes), 4))
    _kick(nodes, table, np.ascontiguousarray(near), cuts)
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


@njit(cache=True)
def _kick(order, cost, near, cuts):  # type: ignore[no-untyped-def]
    """Kick and repair, in place, the inner points of a path whose ends stay."""
    n = len(order)
    at = np.empty(len(cost), dtype=np.int64)
    for i in range(n):
        at[order[i]] = i
    kept = order.copy()
    queue = np.empty(n, dtype=np.int64)
    queued = np.zeros(len(cost), dtype=np.bool_)
    for k in range(len(cuts)):
        # A double bridge inside a short stretch: a·b·c·d becomes a·c·b·d.
        span = min(KICKED, n - 2)
        low = 1 + int(cuts[k, 0] * (n - 1 - span))
        lengths = np.sort(cuts[k, 1:] * (span - 1))
        i, j, m = low + int(lengths[0]), low + int(lengths[1]) + 1, low + int(lengths[2]) + 2
        if not (i < j < m <= n - 1):
            continue
        before = cost[order[i - 1], order[i]] + cost[order[j - 1], order[j]] + cost[order[m - 1], order[m]]
        after = cost[order[i - 1], order[j]] + cost[order[m - 1], order[i]] + cost[order[j - 1], order[m]]
        first, last = i, m - 1
        _swap_stretches(order, i, j, m)
        for p in range(i, m):
            at[order[p]] = p
        size = 0
        for p in (i - 1, i, i + m - j - 1, i + m - j, m - 1, m):
            if not queued[order[p]]:
                queued[order[p]] = True
                queue[size] = order[p]
                size += 1
        gain = before - after
        while size > 0:
            size -= 1
            node = queue[size]
            queued[node] = False
            saved, a, b = _better_around(order, cost, near, at, node)
            while saved > LEAST_GAIN:
                gain += saved
                first, last = min(first, a), max(last, b)
                for p in (a - 1, a, b, b + 1):
                    if 0 <= p < n and not queued[order[p]]:
                        queued[order[p]] = True
                        queue[size] = order[p]
                        size += 1
                saved, a, b = _better_around(order, cost, near, at, node)
        if gain < -LEAST_GAIN:
            for p in range(first, last + 1):
                order[p] = kept[p]
                at[order[p]] = p
        else:
            for p in range(first, last + 1):
                kept[p] = order[p]


@njit(cache=True)
def _swap_stretches(order, i, j, m):  # type: ignore[no-untyped-def]
    """order[i:j] and order[j:m] change places."""
    _reverse(order, i, j - 1)
    _reverse(order, j, m - 1)
    _reverse(order, i, m - 1)


@njit(cache=True)
def _better_around(order, cost, near, at, node):  # type: ignore[no-untyped-def]
    """Make the first move found that joins `node` to a near point and shortens the path: 2-opt, or up to
    three points from `node` on put beside the near one. What was saved, and first and last place changed."""
    n = len(order)
    p = at[node]
    for forward in (True, False):  # the joint after node, or the one before it
        if (p == n - 1 and forward) or (p == 0 and not forward):
            continue
        other = order[p + 1] if forward else order[p - 1]
        here = cost[node, other]
        for c in near[node]:
            if cost[node, c] >= here - LEAST_GAIN:
                break
            q = at[c]
            if (q == n - 1 and forward) or (q == 0 and not forward):
                continue
            beyond = order[q + 1] if forward else order[q - 1]
            saved = here + cost[c, beyond] - cost[node, c] - cost[other, beyond]
            if saved > LEAST_GAIN:
                a, b = (min(p, q) + 1, max(p, q)) if forward else (min(p, q), max(p, q) - 1)
                if a >= 1 and b <= n - 2:
                    _reverse(order, a, b)
                    for t in range(a, b + 1):
                        at[order[t]] = t
                    return saved, a, b
    for size in range(1, 4):
        for start in (p, p - size + 1):  # node first or last of the stretch that moves
            end = start + size - 1
            if start < 1 or end > n - 2:
                continue
            left, right = order[start - 1], order[end + 1]
            taken = cost[left, order[start]] + cost[order[end], right] - cost[left, right]
            if taken <= LEAST_GAIN:
                continue
            tail = order[end] if start == p else order[start]  # the end that is not node
            for c in near[node]:
                if cost[node, c] >= taken - LEAST_GAIN:
                    break
                q = at[c]
                if start <= q <= end:
                    continue
                for after in (True, False):  # node goes to this side of c
                    if (q == n - 1 and after) or (q == 0 and not after):
                        continue
                    d = order[q + 1] if after else order[q - 1]
                    if start <= at[d] <= end:
                        continue
                    saved = taken - cost[c, node] - cost[tail, d] + cost[c, d]
                    if saved <= LEAST_GAIN:
                        continue
                    # The stretch's order once moved: node beside c, tail beside d.
                    turned = (start == p) != after if size > 1 else False
                    if q > end:
                        stop = q if after else q - 1
                        _swap_stretches(order, start, end + 1, stop + 1)
                        a, b, low = start, stop, stop - size + 1
                    else:
                        stop = q + 1 if after else q
                        _swap_stretches(order, stop, start, end + 1)
                        a, b, low = stop, end, stop
                    if turned:
                        _reverse(order, low, low + size - 1)
                    for t in range(a, b + 1):
                        at[order[t]] = t
                    return saved, a, b
    return 0.0, 0, 0
