"""The inner loops of RANSAC: which points support a plane.

A point supports a plane (a, b, c, d) when it lies within the distance, its normal agrees (either sign, see
Cloud) and its scanner stands on the plane's side: so the two faces of a thin plate are two planes.
"""

import numba
import numpy as np

from tasks.surfaces.cloud import Floats, Indices, Mask
from tasks.surfaces.grid import Links


@numba.njit(cache=True)
def _supports(
    points: Floats, normals: Floats, views: Floats, i: int, plane: Floats, distance_m: float, cosine: float
) -> bool:
    a, b, c = plane[0], plane[1], plane[2]
    if abs(a * points[i, 0] + b * points[i, 1] + c * points[i, 2] + plane[3]) > distance_m:
        return False
    if abs(a * normals[i, 0] + b * normals[i, 1] + c * normals[i, 2]) < cosine:
        return False
    return bool(a * views[i, 0] + b * views[i, 1] + c * views[i, 2] > 0.0)


@numba.njit(cache=True)
def _plane_through(points: Floats, a: int, b: int, c: int, plane: Floats) -> None:
    """Writes the plane of three points; zeros, which nothing supports, where they lie on a line."""
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = max(np.sqrt(x * x + y * y + z * z), 1e-12)
    plane[0], plane[1], plane[2] = x / length, y / length, z / length
    plane[3] = -(plane[0] * points[a, 0] + plane[1] * points[a, 1] + plane[2] * points[a, 2])


@numba.njit(cache=True)
def best_samples(
    points: Floats,
    normals: Floats,
    views: Floats,
    free: Mask,
    start: Indices,
    draws: Floats,
    distance_m: float,
    cosine: float,
) -> tuple[Mask, Indices]:
    """For each cell the minimal sample (three free points) that most of its free points support.

    draws: (C, K, 3) in [0, 1), K samples per cell. Returns (N,) the supporting points and (C,) how many.
    """
    inlier = np.zeros(len(points), dtype=np.bool_)
    counts = np.zeros(len(start) - 1, dtype=np.int64)
    members = np.empty(len(points), dtype=np.int64)
    plane = np.zeros(4)
    best = np.zeros(4)
    for cell in range(len(start) - 1):
        n = 0
        for i in range(start[cell], start[cell + 1]):
            if free[i]:
                members[n] = i
                n += 1
        if n < 3:
            continue
        for k in range(draws.shape[1]):
            a, b, c = (
                members[int(draws[cell, k, 0] * n)],
                members[int(draws[cell, k, 1] * n)],
                members[int(draws[cell, k, 2] * n)],
            )
            _plane_through(points, a, b, c, plane)
            if plane[0] * views[a, 0] + plane[1] * views[a, 1] + plane[2] * views[a, 2] < 0.0:
                for axis in range(4):
                    plane[axis] = -plane[axis]
            if not (
                _supports(points, normals, views, a, plane, distance_m, cosine)
                and _supports(points, normals, views, b, plane, distance_m, cosine)
                and _supports(points, normals, views, c, plane, distance_m, cosine)
            ):
                continue
            count = 0
            for m in range(n):
                count += _supports(points, normals, views, members[m], plane, distance_m, cosine)
            if count > counts[cell]:
                counts[cell] = count
                for axis in range(4):
                    best[axis] = plane[axis]
        if counts[cell]:
            for m in range(n):
                inlier[members[m]] = _supports(points, normals, views, members[m], best, distance_m, cosine)
    return inlier, counts


@numba.njit(cache=True)
def support_counts(
    points: Floats, normals: Floats, views: Floats, planes: Floats, distance_m: float, cosine: float
) -> Indices:
    """(K,) how many of the points support each of (K, 4) planes."""
    counts = np.zeros(len(planes), dtype=np.int64)
    for k in range(len(planes)):
        for i in range(len(points)):
            counts[k] += _supports(points, normals, views, i, planes[k], distance_m, cosine)
    return counts


@numba.njit(cache=True)
def connected_support(
    points: Floats,
    normals: Floats,
    views: Floats,
    free: Mask,
    start: Indices,
    neighbours: Links,
    seed_cell: int,
    seen: Indices,
    turn: int,
    plane: Floats,
    distance_m: float,
    cosine: float,
) -> Indices:
    """Free points that support the plane, in cells that a chain of neighbours with such points joins to
    the seed cell; ascending. seen: (C,) scratch, in which no cell holds `turn` yet."""
    stack = np.empty(len(seen), dtype=np.int64)
    chosen = np.empty(len(points), dtype=np.int64)
    stack[0], waiting, found = seed_cell, 1, 0
    seen[seed_cell] = turn
    while waiting:
        waiting -= 1
        cell = stack[waiting]
        before = found
        for i in range(start[cell], start[cell + 1]):
            if free[i] and _supports(points, normals, views, i, plane, distance_m, cosine):
                chosen[found] = i
                found += 1
        if found > before:
            for k in range(neighbours.shape[1]):
                neighbour = neighbours[cell, k]
                if neighbour >= 0 and seen[neighbour] != turn:
                    seen[neighbour] = turn
                    stack[waiting] = neighbour
                    waiting += 1
    return np.sort(chosen[:found])
