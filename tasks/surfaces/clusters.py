"""Euclidean clusters (paper, eq. 2): groups of points that are more than ε apart from all others."""

import numba
import numpy as np

from tasks.surfaces.cloud import Floats, Indices
from tasks.surfaces.grid import Grid, Links


def euclidean_clusters(points_m: Floats, epsilon_m: float) -> Indices:
    """(N,) labels 0, 1, …: two points share a label when a chain of steps ≤ ε joins them. Exact.

    As printed, eq. 2 calls C = {p_i | min ‖p_i − p_j‖ > ε, p_j ∉ C} a cluster: two clusters are more than
    ε apart. Within a grid cell of diagonal ε all points are joined; two cells are joined by their first
    pair of points within ε, and cells that are joined already are not looked at.
    """
    if not len(points_m):
        return np.zeros(0, dtype=np.int64)
    grid = Grid(points_m, epsilon_m / np.sqrt(3.0), reach=2)
    root = _join(points_m[grid.order], grid.start, grid.neighbours, epsilon_m**2)
    of_cell = np.unique(root, return_inverse=True)[1]
    labels = np.empty(len(points_m), dtype=np.int64)
    labels[grid.order] = np.repeat(of_cell, np.diff(grid.start))
    return labels


@numba.njit(cache=True)
def _join(points: Floats, start: Indices, neighbours: Links, epsilon_squared: float) -> Indices:
    parent = np.arange(len(start) - 1)
    for cell in range(len(parent)):
        for neighbour in neighbours[cell]:
            if neighbour <= cell:  # −1: empty; smaller: done from the other side
                continue
            a = cell
            while parent[a] != a:
                parent[a] = parent[parent[a]]
                a = parent[a]
            b = neighbour
            while parent[b] != b:
                parent[b] = parent[parent[b]]
                b = parent[b]
            if a != b and _closer(points, start, cell, neighbour, epsilon_squared):
                parent[max(a, b)] = min(a, b)
    for cell in range(len(parent)):
        root = cell
        while parent[root] != root:
            root = parent[root]
        parent[cell] = root
    return parent


@numba.njit(cache=True)
def _closer(points: Floats, start: Indices, one: int, other: int, epsilon_squared: float) -> bool:
    for i in range(start[one], start[one + 1]):
        for j in range(start[other], start[other + 1]):
            dx = points[i, 0] - points[j, 0]
            dy = points[i, 1] - points[j, 1]
            dz = points[i, 2] - points[j, 2]
            if dx * dx + dy * dy + dz * dz <= epsilon_squared:
                return True
    return False
