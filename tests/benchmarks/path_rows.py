"""Rows of `make bench-planning` on path search: exact against Dijkstra, and how fast beside other tools."""

from typing import Any

import numpy as np
import numpy.typing as npt

from tests.benchmarks.table import Row, absent, cpu_s, row

Flags = npt.NDArray[np.bool_]
GRID = (200, 200, 60)
QUERIES, SOURCES = 200, 10


def obstacles(rng: np.random.Generator) -> Flags:
    """Free voxels of a grid with 60 boxes in it, about a quarter of it taken."""
    free = np.ones(GRID, dtype=bool)
    for _ in range(60):
        size = rng.integers(10, 50, 3)
        low = rng.integers(0, np.array(GRID) - 5)
        free[tuple(slice(a, a + s) for a, s in zip(low, size, strict=True))] = False
    return free


def step_graph(free: Flags, weights: tuple[float, float, float]) -> Any:
    """The same steps and costs as a sparse matrix, written apart from the search: no corner is cut."""
    from itertools import product

    from scipy.sparse import coo_array, csr_array

    numbers = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    parts = []
    for step in (s for s in product((-1, 0, 1), repeat=3) if any(s)):
        here = tuple(slice(max(0, -s), n - max(0, s)) for s, n in zip(step, free.shape, strict=True))
        open_ = free[here].copy()
        for corner in product(*[sorted({0, s}) for s in step]):
            moved = tuple(slice(h.start + c, h.stop + c) for h, c in zip(here, corner, strict=True))
            open_ &= free[moved]
        there = tuple(slice(h.start + s, h.stop + s) for h, s in zip(here, step, strict=True))
        rows, columns = numbers[here][open_], numbers[there][open_]
        cost = float(sum(w * s * s for w, s in zip(weights, step, strict=True)))
        parts.append(
            csr_array(coo_array((np.full(len(rows), cost), (rows, columns)), shape=(free.size,) * 2))
        )
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


def rows() -> list[Row]:
    """200 queries from 10 places to 20 each: the cost of each against Dijkstra's on the identical graph."""
    from scipy.sparse.csgraph import dijkstra

    from tasks.planning.astar import PathFinder

    rng = np.random.default_rng(7)
    weights = (1.0, 1.0, 1.0)
    free = obstacles(rng)
    cells = np.argwhere(free)
    starts = rng.choice(cells, SOURCES, replace=False)
    goals = [rng.choice(cells, QUERIES // SOURCES, replace=False) for _ in starts]
    graph = step_graph(free, weights)
    finder = PathFinder(free, weights)
    finder.path(tuple(starts[0]), tuple(goals[0][0]))
    worst, ours, theirs = 0.0, 0.0, 0.0
    for start, ends in zip(starts, goals, strict=True):
        seconds, costs = cpu_s(
            lambda start=start: dijkstra(graph, indices=int(np.ravel_multi_index(tuple(start), GRID)))
        )
        theirs += seconds / SOURCES
        for end in ends:
            seconds, found = cpu_s(lambda a=start, b=end: finder.path(tuple(a), tuple(b)))
            ours += seconds / QUERIES
            truth = costs[np.ravel_multi_index(tuple(end), GRID)]
            cost = np.inf if found is None else found[1]
            worst = max(worst, 0.0 if cost == truth else abs(cost - truth))
    data, seed = "200 × 200 × 60 voxels, 60 boxes, 200 queries", "7"
    found_rows = [
        row("largest difference of a path's cost", worst, "1", "≤ 1e-9", data, seed, "scipy dijkstra", 0.0),
        row("speed against the peer", theirs / ours, "×", "≥ 20", data, seed, "scipy dijkstra", 1.0),
        row("time of a query", ours * 1000, "ms", None, data, seed, "scipy dijkstra", theirs * 1000),
    ]
    found_rows += [peer(free, starts, goals, ours, data, seed) for peer in (mcp, pathfinding)]
    return found_rows


def mcp(free: Flags, starts: Any, goals: Any, ours: float, data: str, seed: str) -> Row:
    name = "skimage MCP_Geometric"
    try:
        from skimage.graph import MCP_Geometric
    except ImportError as problem:
        return absent("time of a query", name, problem)
    costs = np.where(free, 1.0, -1.0)
    seconds, _ = cpu_s(lambda: MCP_Geometric(costs).find_costs([tuple(starts[0])], [tuple(goals[0][0])]))
    return row("speed against the peer", seconds / ours, "×", "≥ 1", data, seed, name, 1.0)


def pathfinding(free: Flags, starts: Any, goals: Any, ours: float, data: str, seed: str) -> Row:
    name = "pathfinding3d"
    try:
        from pathfinding3d.core.diagonal_movement import DiagonalMovement
        from pathfinding3d.core.grid import Grid
        from pathfinding3d.finder.a_star import AStarFinder
    except ImportError as problem:
        return absent("time of a query", name, problem)
    grid = Grid(matrix=free.astype(int).tolist())
    start, end = grid.node(*map(int, starts[0])), grid.node(*map(int, goals[0][0]))
    finder = AStarFinder(diagonal_movement=DiagonalMovement.only_when_no_obstacle)
    seconds, _ = cpu_s(lambda: finder.find_path(start, end, grid))
    return row("speed against the peer", seconds / ours, "×", "≥ 1", data, seed, name, 1.0)
