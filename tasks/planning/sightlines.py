"""Which air the scanners have seen to be free.

A place is known to be free where a scanner's line to it meets nothing that was scanned. A direction without
an echo (the sky) says so much less: it counts to `reach_m` and no farther, and nothing where the scanner did
not look. Laser scanners miss wires, glass and what is black and wet; the clearance is no help against these,
a look on site is.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from schemas.contract import Vector3
from schemas.scan_window import ScanWindow

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

FACE_PX = 256  # of each face of a scanner's cube map: a third of a degree
REACH_OF_FACE = 1.05  # each face sees a little more than its 90°, so that none is blind at its edge
POINT_M = 0.08  # half the side of what a scanned point hides: points stand 5 cm apart
WIDEST_PX = 24  # a point closer than this makes it is the scanner's own tripod


def seen_free(
    places_low_m: Array, voxel_m: float, shape: tuple[int, int, int],
    points_m: Array, stations_m: Sequence[Vector3], reach_m: float, windows: Sequence[ScanWindow] = (),
) -> Flags:  # fmt: skip
    """(nx, ny, nz) of a grid whose first centre is at places_low_m: whether any scanner saw that place.

    points_m: (N, 3) everything scanned, by whichever scanner. windows: where each looked; none: all round."""
    seen = np.zeros(shape, dtype=np.bool_)
    for station, window in zip(stations_m, windows or [ScanWindow()] * len(stations_m), strict=True):
        eye = np.asarray(station, dtype=np.float64)
        depth = _cube_map(np.ascontiguousarray(points_m - eye))
        low = np.asarray(places_low_m - eye, dtype=np.float64)
        slopes = np.sin(np.radians([window.lowest_deg, window.highest_deg]))
        _look(seen, low, voxel_m, depth, reach_m, _looked_at(window), slopes[0], slopes[1])
    return seen


def _looked_at(window: ScanWindow) -> Flags:
    """(360,) of each degree of azimuth, counter-clockwise from east."""
    azimuth = np.arange(360) + 0.5
    looked = np.ones(360, dtype=np.bool_)
    for start, end in window.blind_deg:
        looked &= (azimuth - start) % 360 > (end - start) % 360
    return looked


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
def _look(seen, low, voxel_m, depth, reach_m, looked, lowest, highest):  # type: ignore[no-untyped-def]
    half = FACE_PX / 2
    for i in range(seen.shape[0]):
        x = low[0] + i * voxel_m
        for j in range(seen.shape[1]):
            y = low[1] + j * voxel_m
            column_looked = looked[int(np.degrees(np.arctan2(y, x)) % 360.0) % 360]
            for k in range(seen.shape[2]):
                if seen[i, j, k]:
                    continue
                z = low[2] + k * voxel_m
                distance = np.sqrt(x * x + y * y + z * z)
                if not (column_looked and lowest * distance <= z <= highest * distance):
                    continue
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
                seen[i, j, k] = distance < first if first < np.inf else distance <= reach_m
