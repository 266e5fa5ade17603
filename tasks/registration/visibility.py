"""What a scanner saw through is empty: points of another scan that stand there say the alignment is wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tasks.registration.rigid_motion import Array, transform
from tasks.registration.station_cloud import Cloud, facing

CELLS_DEG = (1.5, 3.0, 6.0)  # of a range image: the finest that the scan fills
FILLED = 0.2  # of the cells that saw something, those whose neighbours did too
MARGIN_M = 0.3  # a coarse alignment may be off by this
FLAT = 0.5  # share of directions with one range only, below which a cloud is not of one scanner
LEAST_WEIGHT = 0.05  # no facing counts as rarer than this
ENOUGH = 20.0  # points in common sight; fewer say nothing

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class RangeImage:
    """What one scanner saw in each direction."""

    scanner_m: Array  # (3,) in the scan's frame
    cell_deg: float
    nearest_m: Array  # (rows, columns) over a cell and its neighbours; 0 where one of them saw nothing
    sky: Mask  # (rows, columns) in view above the horizon, neither cell nor neighbours saw anything
    usual_m: float  # within this range a surface is seen

    def judge(self, points_m: Array) -> tuple[Mask, Mask]:
        """Of (N, 3) points in the scan's frame: through which the laser passed, and where it ended."""
        row, column, range_m = _directions(points_m - self.scanner_m, self.cell_deg)
        limit_m = self.nearest_m[row, column]
        through = (limit_m > 0) & (range_m < limit_m - MARGIN_M)
        through |= self.sky[row, column] & (range_m < self.usual_m)
        return through, (limit_m > 0) & (np.abs(range_m - limit_m) <= MARGIN_M)


def range_image(cloud: Cloud, scanner_m: Array | None) -> RangeImage | None:
    """None for a cloud that was not taken from the point that it states (mobile, merged or aerial), and for
    one too sparse to say what is empty."""
    if scanner_m is None:
        return None
    offset_m = cloud.points_m.astype(np.float64) - scanner_m
    images = (_image(offset_m, scanner_m, cell_deg) for cell_deg in CELLS_DEG)
    return next((image for image, filled in images if filled >= FILLED), None)


def _image(offset_m: Array, scanner_m: Array, cell_deg: float) -> tuple[RangeImage | None, float]:
    """The image, and how much of it is filled."""
    row, column, range_m = _directions(offset_m, cell_deg)
    rows, columns = int(180 / cell_deg), int(360 / cell_deg)
    nearest = np.full((rows, columns), np.inf)
    np.minimum.at(nearest, (row, column), range_m)
    farthest = np.zeros((rows, columns))
    np.maximum.at(farthest, (row, column), range_m)
    hit = np.isfinite(nearest)
    if np.mean((farthest - nearest)[hit] < 0.1 * nearest[hit] + 1.0) < FLAT:
        return None, 1.0
    around, whole, empty = nearest.copy(), hit.copy(), ~hit
    for up in (-1, 0, 1):
        for side in (-1, 0, 1):
            shifted = np.roll(nearest, (up, side), axis=(0, 1))
            around = np.minimum(around, shifted)
            whole &= np.isfinite(shifted)
            empty &= ~np.isfinite(shifted)
    in_view = hit.any(axis=1)[:, None] & hit.any(axis=0)[None, :]
    in_view[: rows // 2 + 1] = False  # water, and what stands too near to be measured, return nothing either
    image = RangeImage(
        scanner_m,
        cell_deg,
        np.where(whole, around, 0.0),
        empty & in_view,
        float(np.percentile(range_m, 90)),
    )
    return image, float(whole.sum() / hit.sum())


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


def contradiction(sights: Sequence[tuple[float, float]]) -> float | None:
    """Share of all that was in sight that was seen through; None where too little was in sight.

    True alignments of still scenes have 0.00, of streets and rooms up to 0.08; wrong ones of look-alike
    bridges 0.12 and more.
    """
    through, met = sum(t for t, _ in sights), sum(m for _, m in sights)
    return through / (through + met) if through + met > ENOUGH else None


def doubt(sights: Sequence[tuple[float, float]]) -> float:
    """To rank motions by: as `contradiction`, but that one which brings little into sight is half doubted."""
    through, met = sum(t for t, _ in sights), sum(m for _, m in sights)
    return (through + ENOUGH) / (through + met + 2 * ENOUGH)


def _directions(
    offset_m: Array, cell_deg: float
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array]:
    range_m = np.maximum(np.linalg.norm(offset_m, axis=1), 1e-6)
    azimuth = np.degrees(np.arctan2(offset_m[:, 1], offset_m[:, 0])) % 360.0
    elevation = np.degrees(np.arcsin(np.clip(offset_m[:, 2] / range_m, -1, 1))) + 90.0
    column = np.minimum((azimuth / cell_deg).astype(np.int64), int(360 / cell_deg) - 1)
    row = np.minimum((elevation / cell_deg).astype(np.int64), int(180 / cell_deg) - 1)
    return row, column, range_m
