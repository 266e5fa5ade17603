"""What a scanner saw through is empty: points of another scan that stand there say the alignment is wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tasks.registration.rigid_motion import Array, transform
from tasks.registration.station_cloud import Cloud, facing

CELL_DEG = 1.5
COLUMNS, ROWS = int(360 / CELL_DEG), int(180 / CELL_DEG)
MARGIN_M = 0.3  # a coarse alignment may be off by this
FLAT = 0.5  # share of directions with one range only, below which a cloud is not of one scanner
LEAST_WEIGHT = 0.05  # no facing counts as rarer than this
ENOUGH = 20.0  # points in common sight; fewer say nothing

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class RangeImage:
    """What one scanner saw in each direction."""

    scanner_m: Array  # (3,) in the scan's frame
    nearest_m: Array  # (ROWS, COLUMNS) over a cell and its neighbours; 0 where one of them saw nothing
    sky: Mask  # (ROWS, COLUMNS) in view above the horizon, neither cell nor neighbours saw anything
    usual_m: float  # within this range a surface is seen

    def judge(self, points_m: Array) -> tuple[Mask, Mask]:
        """Of (N, 3) points in the scan's frame: through which the laser passed, and where it ended."""
        row, column, range_m = _directions(points_m - self.scanner_m)
        limit_m = self.nearest_m[row, column]
        through = (limit_m > 0) & (range_m < limit_m - MARGIN_M)
        through |= self.sky[row, column] & (range_m < self.usual_m)
        return through, (limit_m > 0) & (np.abs(range_m - limit_m) <= MARGIN_M)


def range_image(cloud: Cloud, scanner_m: Array | None) -> RangeImage | None:
    """None for a cloud that was not taken from the point that it states (mobile, merged or aerial)."""
    if scanner_m is None:
        return None
    row, column, range_m = _directions(cloud.points_m.astype(np.float64) - scanner_m)
    nearest = np.full((ROWS, COLUMNS), np.inf)
    np.minimum.at(nearest, (row, column), range_m)
    farthest = np.zeros((ROWS, COLUMNS))
    np.maximum.at(farthest, (row, column), range_m)
    hit = np.isfinite(nearest)
    if np.mean((farthest - nearest)[hit] < 0.1 * nearest[hit] + 1.0) < FLAT:
        return None
    around, whole, empty = nearest.copy(), hit.copy(), ~hit
    for up in (-1, 0, 1):
        for side in (-1, 0, 1):
            shifted = np.roll(nearest, (up, side), axis=(0, 1))
            around = np.minimum(around, shifted)
            whole &= np.isfinite(shifted)
            empty &= ~np.isfinite(shifted)
    in_view = hit.any(axis=1)[:, None] & hit.any(axis=0)[None, :]
    in_view[: ROWS // 2 + 1] = False  # water, and what stands too near to be measured, return nothing either
    return RangeImage(
        scanner_m, np.where(whole, around, 0.0), empty & in_view, float(np.percentile(range_m, 90))
    )


def sight(
    first: Cloud,
    second: Cloud,
    first_image: RangeImage | None,
    second_image: RangeImage | None,
    T_second_first: Array,
    T_first_second: Array,
) -> tuple[float, float]:
    """How much of what stands in the other scanner's sight that one saw through, and how much it met.

    All facings weigh alike, else the ground, which agrees with any ground, would hide the contradictions
    of the rest.
    """
    through = met = 0.0
    for cloud, image, T in ((first, second_image, T_second_first), (second, first_image, T_first_second)):
        if image is None:
            continue
        face = facing(cloud.normals)
        weights = 1 / np.maximum(np.bincount(face, minlength=6) / len(face), LEAST_WEIGHT)
        passed, ended = image.judge(transform(T, cloud.points_m))
        through += float(weights[face[passed]].sum())
        met += float(weights[face[ended]].sum())
    return through, met


def contradiction(sights: Sequence[tuple[float, float]]) -> float:
    """Share of all that was in sight that was seen through; 0 where too little was.

    True alignments of still scenes have 0.00, of streets and rooms up to 0.08; wrong ones of look-alike
    bridges 0.17 and more.
    """
    through, met = sum(t for t, _ in sights), sum(m for _, m in sights)
    return through / (through + met) if through + met > ENOUGH else 0.0


def _directions(offset_m: Array) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array]:
    range_m = np.maximum(np.linalg.norm(offset_m, axis=1), 1e-6)
    azimuth = np.degrees(np.arctan2(offset_m[:, 1], offset_m[:, 0])) % 360.0
    elevation = np.degrees(np.arcsin(np.clip(offset_m[:, 2] / range_m, -1, 1))) + 90.0
    column = np.minimum((azimuth / CELL_DEG).astype(np.int64), COLUMNS - 1)
    row = np.minimum((elevation / CELL_DEG).astype(np.int64), ROWS - 1)
    return row, column, range_m
