"""Which air the scanners have seen to be free.

A place is known to be free where a scanner's line to it meets nothing that was scanned. A direction without
an echo (the sky) says so much less: it counts to `reach_m` and no farther. Laser scanners miss wires, glass
and what is black and wet; the clearance is no help against these, a look on site is.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from schemas.contract import Vector3

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

FACE_PX = 256  # of each face of a scanner's cube map: a third of a degree
REACH_OF_FACE = 1.05  # each face sees a little more than its 90°, so that none is blind at its edge
POINT_M = 0.08  # half the side of what a scanned point hides: points stand 5 cm apart
WIDEST_PX = 24  # a point closer than this makes it is the scanner's own tripod


def seen_free(
    places_low_m: Array, voxel_m: float, shape: tuple[int, int, int],
    points_m: Array, stations_m: Sequence[Vector3], reach_m: float,
) -> Flags:  # fmt: skip
    """(nx, ny, nz) of a grid whose first centre is at places_low_m: whether any scanner saw that place.

    points_m: (N, 3) everything scanned, by whichever scanner."""
    seen = np.zeros(shape, dtype=np.bool_)
    for station in stations_m:
        eye = np.asarray(station, dtype=np.float64)
        depth = _cube_map(np.ascontiguousarray(points_m - eye))
        _look(seen, np.asarray(places_low_m - eye, dtype=np.float64), voxel_m, depth, reach_m)
    return seen


@njit(cache=True)
def _on_face(x, y, z, face):  # type: ignore[no-untyped-def]
    """Depth along the face's axis (faces 0..5: +x −x +y −y +z −z) and the two coordinates across it."""
    axis = face // 2
    sign = 1.0 - 2.0 * (face % 2)
    if axis == 0:
        return sign * x, y, z
    if axis == 1:
        return sign * y, x, z
    return sign * z, x, y


@njit(cache=True)
def _cube_map(rays):  # type: ignore[no-untyped-def]
    """(6, F, F) distance of the nearest point in each direction, infinity where there is none."""
    depth = np.full((6, FACE_PX, FACE_PX), np.inf)
    half = FACE_PX / 2
    for n in range(len(rays)):
        x, y, z = rays[n, 0], rays[n, 1], rays[n, 2]
        distance = np.sqrt(x * x + y * y + z * z)
        for face in range(6):
            along, a, b = _on_face(x, y, z, face)
            if along <= 1e-6 or max(abs(a), abs(b)) > 1.3 * along:
                continue
            column = half + half * a / along / REACH_OF_FACE
            row = half + half * b / along / REACH_OF_FACE
            size = min(half * POINT_M / along / REACH_OF_FACE, WIDEST_PX) + 0.5
            for i in range(max(0, int(row - size)), min(FACE_PX - 1, int(row + size)) + 1):
                for j in range(max(0, int(column - size)), min(FACE_PX - 1, int(column + size)) + 1):
                    depth[face, i, j] = min(depth[face, i, j], distance)
    return depth


@njit(cache=True)
def _look(seen, low, voxel_m, depth, reach_m):  # type: ignore[no-untyped-def]
    half = FACE_PX / 2
    for i in range(seen.shape[0]):
        x = low[0] + i * voxel_m
        for j in range(seen.shape[1]):
            y = low[1] + j * voxel_m
            for k in range(seen.shape[2]):
                if seen[i, j, k]:
                    continue
                z = low[2] + k * voxel_m
                if abs(x) >= abs(y) and abs(x) >= abs(z):
                    face = 0 if x > 0 else 1
                elif abs(y) >= abs(z):
                    face = 2 if y > 0 else 3
                else:
                    face = 4 if z > 0 else 5
                along, a, b = _on_face(x, y, z, face)
                along = max(along, 1e-9)
                column = int(half + half * a / along / REACH_OF_FACE)
                row = int(half + half * b / along / REACH_OF_FACE)
                first = depth[face, row, column]
                distance = np.sqrt(x * x + y * y + z * z)
                seen[i, j, k] = distance < first if first < np.inf else distance <= reach_m
