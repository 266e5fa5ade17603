"""What an observation's pixel does when its photo, its lens or its point moves: in closed form, one after
another."""

import numba
import numpy as np

from tasks.stitching.tracks import Index
from tasks.stitching.view import Array


@numba.njit(cache=True, nogil=True, error_model="numpy")
def differentiate(
    photo: Index,
    track: Index,
    R: Array,
    focal: Array,
    height: Array,
    roll: Array,
    rolled: Array,
    in_camera: Array,
    distorted: Array,
    by_k1: Array,
    by_ideal: Array,
    slope: Array,
    residual: Array,
) -> tuple[Array, Array]:
    """Of residuals as taken: (M, 2, 12) by the photo's eight numbers and its lens's four, and (M, 2, 3) by
    the point: two along the surface, its height over it.

    photo, track, rolled (M,): as in Bundle. R (n, 3, 3), focal (n,) px, height (n,) px and roll (n, 2) of the
    photos. in_camera (M, 3); distorted, by_k1 (M, 2) and by_ideal (M, 2, 2): ideal coordinates as the lens
    distorts them, and how these change. slope (tracks, 2) of the surface. residual (M, 2) px."""
    camera, point = np.zeros((len(photo), 2, 12)), np.empty((len(photo), 2, 3))
    by_camera, moving = np.empty((2, 3)), np.empty((2, 3))
    for m in range(len(photo)):
        k, f = photo[m], focal[photo[m]]
        a, b, c = in_camera[m]
        for i in range(2):
            u, v = f * by_ideal[m, i, 0] / c, f * by_ideal[m, i, 1] / c
            by_camera[i, 0], by_camera[i, 1], by_camera[i, 2] = u, v, -(u * a + v * b) / c
            for j in range(3):
                moving[i, j] = 0.0
                for n in range(3):
                    moving[i, j] += by_camera[i, n] * R[k, j, n]
            x, y, z = by_camera[i]
            camera[m, i, 0], camera[m, i, 1], camera[m, i, 2] = y * c - z * b, z * a - x * c, x * b - y * a
            for j in range(3):
                camera[m, i, 3 + j] = -moving[i, j]
            camera[m, i, 6 + i] = rolled[m] + residual[m, 1] / height[k]  # the instant of the row foretold
            camera[m, i, 8], camera[m, i, 9], camera[m, i, 10 + i] = f * distorted[m, i], f * by_k1[m, i], 1.0
            for j in range(2):  # a point that moves on the surface rises and falls with it
                point[m, i, j] = moving[i, j] + moving[i, 2] * slope[track[m], j]
            point[m, i, 2] = moving[i, 2]
        across, along = roll[k] / height[k]  # as taken: what bundle makes of the residuals too
        for j in range(12):
            camera[m, 1, j] /= 1.0 - along
            camera[m, 0, j] += across * camera[m, 1, j]
        for j in range(3):
            point[m, 1, j] /= 1.0 - along
            point[m, 0, j] += across * point[m, 1, j]
    return camera, point
