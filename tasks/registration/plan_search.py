"""Coarse alignment of levelled scanners of which nothing is known: yaw and shift, searched on the plan.

Seen from above, a wall is a line that faces its scanner. The plan of a scan is a complex image: in each cell
the sum of the horizontal normals of its upright surfaces, x + iy; and a second image of the surfaces that
look down (soffits). The correlation of two plans, by FFT for all shifts at once and for all yaws in turn, is
high only where walls lie on walls and face the same way.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import fft
from scipy.ndimage import gaussian_filter

from tasks.registration.rigid_motion import Array, yaw
from tasks.registration.station_cloud import Cloud

STEP_DEG = 2.0
MOST_CELLS = 320  # a side of the plan, before padding
UPRIGHT, DOWN = 0.5, -0.7  # z of the normals of upright and of downward surfaces
Plan = npt.NDArray[np.complex64]


@dataclass(frozen=True)
class _Facing:
    """Points that draw a plan, with the complex number that each adds to its cell."""

    xy_m: Array
    wall: npt.NDArray[np.complex128]
    soffit: npt.NDArray[np.complex128]


def shifts_and_turns(source: Cloud, target: Cloud, cell_m: float, best: int) -> list[Array]:
    """The `best` T_target_source (yaw and horizontal shift) by correlation, the highest first."""
    ours, theirs = _facing(source), _facing(target)
    if min(len(ours.xy_m), len(theirs.xy_m)) < 10:
        return []
    low_m = theirs.xy_m.min(axis=0)
    size_m = max(float(np.ptp(theirs.xy_m, axis=0).max()), 2 * float(np.linalg.norm(ours.xy_m, axis=1).max()))
    cell_m = max(cell_m, size_m / MOST_CELLS)
    side = fft.next_fast_len(2 * int(np.ceil(size_m / cell_m)) + 2)
    plans = [
        np.conj(fft.fft2(_drawn(theirs.xy_m - low_m, value, cell_m, side, blur=True)))
        for value in (theirs.wall, theirs.soffit)
    ]
    found: list[tuple[float, float, Array]] = []
    for angle in np.radians(np.arange(0.0, 360.0, STEP_DEG)):
        c, s = np.cos(angle), np.sin(angle)
        turned_m = ours.xy_m @ np.array([[c, s], [-s, c]])
        wall = fft.fft2(_drawn(turned_m, ours.wall * np.exp(1j * angle), cell_m, side))
        soffit = fft.fft2(_drawn(turned_m, ours.soffit, cell_m, side))
        score = fft.ifft2(np.conj(wall * plans[0] + soffit * plans[1])).real
        for _ in range(3):
            i, j = np.unravel_index(int(score.argmax()), score.shape)
            shift_m = np.array([i, j]) * cell_m
            shift_m = np.where(shift_m > side * cell_m / 2, shift_m - side * cell_m, shift_m) + low_m
            found.append((float(score[i, j]), float(angle), shift_m))
            score[np.ix_(np.arange(i - 2, i + 3) % side, np.arange(j - 2, j + 3) % side)] = -np.inf
    found.sort(key=lambda item: -item[0])
    chosen: list[tuple[float, Array]] = []
    for _, angle, shift_m in found:
        if all(
            np.linalg.norm(shift_m - other_m) > 3 * cell_m or np.cos(angle - other) < np.cos(np.radians(7.0))
            for other, other_m in chosen
        ):
            chosen.append((angle, shift_m))
        if len(chosen) == best:
            break
    return [yaw(angle, [shift_m[0], shift_m[1], 0.0]) for angle, shift_m in chosen]


def _facing(cloud: Cloud) -> _Facing:
    n = cloud.normals.astype(np.float64)
    upright = np.abs(n[:, 2]) < UPRIGHT
    down = n[:, 2] < DOWN
    drawn = upright | down
    return _Facing(
        cloud.points_m[drawn, :2].astype(np.float64),
        np.where(upright, n[:, 0] + 1j * n[:, 1], 0.0)[drawn],
        down[drawn].astype(np.complex128),
    )


def _drawn(
    xy_m: Array, value: npt.NDArray[np.complex128], cell_m: float, side: int, *, blur: bool = False
) -> Plan:
    """(side, side) sum of the values of each cell, tempered so that high walls do not drown low ones. Cells
    below zero wrap to the far end, as the FFT has it."""
    cells = np.floor(xy_m / cell_m).astype(np.int64) % side
    key = cells[:, 0] * side + cells[:, 1]
    image = np.bincount(key, value.real, side * side) + 1j * np.bincount(key, value.imag, side * side)
    image = (image / np.sqrt(np.maximum(np.abs(image), 1.0))).reshape(side, side)
    if blur:
        image = gaussian_filter(image.real, 1.0, mode="wrap") + 1j * gaussian_filter(
            image.imag, 1.0, mode="wrap"
        )
    return np.asarray(image, dtype=np.complex64)
