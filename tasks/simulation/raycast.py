"""First hits of rays on faces."""

import numba
import numpy as np
import numpy.typing as npt

from tasks.simulation.face import Array, FaceArrays

FAR_M = 1e6
EPSILON_M = 1e-6


@numba.njit(cache=True, nogil=True, inline="always")
def first_hit(px, py, pz, dx, dy, dz, origin, u, v, normal, size):  # type: ignore[no-untyped-def]
    """Index of the first face that the ray p + t·d meets (both sides count), or −1, and its t."""
    best, best_t = -1, FAR_M
    for i in range(len(origin)):
        across = dx * normal[i, 0] + dy * normal[i, 1] + dz * normal[i, 2]
        if abs(across) < 1e-12:
            continue
        ox, oy, oz = origin[i, 0] - px, origin[i, 1] - py, origin[i, 2] - pz
        t = (ox * normal[i, 0] + oy * normal[i, 1] + oz * normal[i, 2]) / across
        if t < EPSILON_M or t >= best_t:
            continue
        qx, qy, qz = t * dx - ox, t * dy - oy, t * dz - oz
        a = qx * u[i, 0] + qy * u[i, 1] + qz * u[i, 2]
        if a < 0.0 or a > size[i, 0]:
            continue
        b = qx * v[i, 0] + qy * v[i, 1] + qz * v[i, 2]
        if b < 0.0 or b > size[i, 1]:
            continue
        best, best_t = i, t
    return best, best_t


@numba.njit(cache=True, nogil=True)
def _cast(points, directions, origin, u, v, normal, size):  # type: ignore[no-untyped-def]
    n = len(directions)
    index, distance = np.empty(n, np.int32), np.empty(n)
    for k in range(n):
        p, d = points[k], directions[k]
        index[k], distance[k] = first_hit(p[0], p[1], p[2], d[0], d[1], d[2], origin, u, v, normal, size)
    return index, distance


def cast(
    points_m: npt.ArrayLike, directions: npt.ArrayLike, faces: FaceArrays
) -> tuple[npt.NDArray[np.int32], Array]:
    """Face index (−1: none) and distance in units of the direction's length, of (N, 3) rays."""
    d = np.ascontiguousarray(np.atleast_2d(np.asarray(directions, dtype=float)))
    p = np.ascontiguousarray(np.broadcast_to(np.asarray(points_m, dtype=float), d.shape))
    index, distance = _cast(p, d, faces.origin, faces.u, faces.v, faces.normal, faces.size)
    return index, distance
