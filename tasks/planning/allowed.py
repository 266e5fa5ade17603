"""Where the vehicle may be at all: in air that is known to be free, inside the fence, outside no-fly boxes.

Unknown space is not free. Known is what a scanner saw through (`sightlines`) and the boxes that the crew
vouches for (`plan.free_m`): above the scanned part, behind what stands in the scanners' way, or wherever a
cloud came without the scanners' positions. The scanned points themselves are `airspace`'s business.
"""

from enum import IntEnum
from itertools import product

import numpy as np
import numpy.typing as npt
import shapely
from scipy import ndimage

from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.structure import Structure
from tasks.planning.sightlines import seen_free

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

MOST_CELLS = 12_000_000  # bounds memory: about 25 bytes a cell while distances are found
SPECK = np.ones((2, 2, 2), dtype=bool)  # thinner unknown spots are the raster's, not the world's

DIRECTIONS = np.array(list(product((-1, 0, 1), repeat=3)))


class Block(IntEnum):
    """Why a place is not free."""

    FREE = 0
    NEAR = 1  # closer to a scanned point than the inflation
    LOW = 2
    HIGH = 3
    UNKNOWN = 4  # no scanner saw it, nobody vouches for it
    FENCE = 5
    NO_FLY = 6


class Allowed:
    """A raster of the region to fly in. `margin_m` is kept from all that is not allowed."""

    def __init__(self, low_m: Array, voxel_m: float, why: npt.NDArray[np.uint8], margin_m: float) -> None:
        self.low_m, self.voxel_m, self.margin_m = low_m, voxel_m, margin_m
        self.why = why  # (nx, ny, nz) Block of each cell
        ringed = np.pad(why == Block.FREE, 1)  # what lies beyond the region was not looked at
        inner = (slice(1, -1),) * 3
        self._distance_m = (ndimage.distance_transform_edt(ringed)[inner] * voxel_m).astype(np.float32)
        # From a place to its cell's middle, and from a middle to its cell's corner, half a diagonal each.
        self._short_m = np.sqrt(3.0) * voxel_m + margin_m

    def _cells(self, places_m: Array) -> tuple[npt.NDArray[np.int64], Flags]:
        index = np.rint((places_m - self.low_m) / self.voxel_m).astype(np.int64)
        inside = np.all((index >= 0) & (index < self.why.shape), axis=-1)
        return np.clip(index, 0, np.array(self.why.shape) - 1), inside

    def slack_m(self, places_m: Array) -> Array:
        """(M,) how far each of (M, 3) places may move in any direction and stay allowed; negative: is not."""
        index, inside = self._cells(places_m)
        slack = self._distance_m[tuple(index.T)].astype(np.float64) - self._short_m
        return np.asarray(np.where(inside, slack, -self._short_m))

    def on_the_climb(self, foot_m: Array, top_m: Array, seen_from_m: float) -> Block:
        """What an upright climb, (3,) to (3,), would enter: what is stated as closed, margin included, or,
        above the height seen_from_m, air that is not known. FREE where it enters neither."""
        (i, j, first), (_, _, last) = self._cells(np.stack([foot_m, top_m]))[0]
        reach = int(np.ceil(self._short_m / self.voxel_m))
        ring, levels = np.arange(-reach, reach + 1), np.arange(first, last + 1)
        rows, columns = (np.clip(at + ring, 0, n - 1) for at, n in zip((i, j), self.why.shape, strict=False))
        beside = np.hypot(ring[:, None], ring) * self.voxel_m <= self._short_m
        passed = self.why[np.ix_(rows, columns, levels)][beside]
        for closed in (Block.NO_FLY, Block.FENCE):
            if (passed == closed).any():
                return closed
        unknown = (self.why[i, j, levels] == Block.UNKNOWN) & (
            self.low_m[2] + levels * self.voxel_m > seen_from_m
        )
        return Block.UNKNOWN if unknown.any() else Block.FREE

    def reasons(self, places_m: Array) -> npt.NDArray[np.int64]:
        """(M,) Block of what is not allowed near each place without slack, FREE for those with."""
        reasons = np.full(len(places_m), int(Block.FREE))
        left = np.flatnonzero(self.slack_m(places_m) < 0)
        index, _ = self._cells(places_m)
        last = np.array(self.why.shape) - 1
        for step in range(int(np.ceil(self._short_m / self.voxel_m)) + 1):
            for direction in DIRECTIONS if step else DIRECTIONS[:1]:
                near = self.why[tuple(np.clip(index[left] + step * direction, 0, last).T)]
                reasons[left] = near
                left = left[near == Block.FREE]
        reasons[left] = Block.UNKNOWN  # beyond the region
        return reasons


def allowed_region(
    structure: Structure,
    points_m: Array,
    settings: PlanSettings,
    margin_m: float,
    low_m: Array,
    high_m: Array,
) -> Allowed:
    """The region from low_m to high_m. Raises BadInput where nothing in it is known to be free."""
    if not structure.stations_m and not settings.free_m:
        raise BadInput(
            "plan.free_m",
            "no scanner's position is known, so no air is known to be free",
            "Bring the single scans in their scanners' own frames, or state the boxes that are free of"
            " obstacles as plan.free_m: [{low_m: [e, n, u], high_m: [e, n, u]}] (hairline plan --free).",
        )
    extent = high_m - low_m
    voxel_m = max(settings.voxel_m, float(np.cbrt(extent.prod() / MOST_CELLS)))
    nx, ny, nz = (int(n) + 1 for n in np.ceil(extent / voxel_m))
    shape = nx, ny, nz
    known = seen_free(
        low_m, voxel_m, shape, points_m, structure.stations_m, settings.scanner_reach_m, structure.windows
    )
    known = ~ndimage.binary_opening(~known, SPECK)
    axes = [low_m[k] + np.arange(shape[k]) * voxel_m for k in range(3)]
    for box in settings.free_m:
        known[_within(axes, box.low_m, box.high_m)] = True
    why = np.where(known, Block.FREE, Block.UNKNOWN).astype(np.uint8)
    if settings.fence_m is not None:
        fence = shapely.Polygon(settings.fence_m)
        east, north = np.meshgrid(axes[0], axes[1], indexing="ij")
        why[~shapely.contains_xy(fence, east, north)] = Block.FENCE
    half = voxel_m / 2
    for box in settings.no_fly_m:
        grown = np.asarray(box.low_m) - half, np.asarray(box.high_m) + half
        why[_within(axes, *grown)] = Block.NO_FLY
    return Allowed(low_m, voxel_m, why, margin_m)


def _within(axes: list[Array], low_m: npt.ArrayLike, high_m: npt.ArrayLike) -> tuple[slice, slice, slice]:
    low, high = np.asarray(low_m), np.asarray(high_m)
    first = [int(np.searchsorted(axes[k], low[k] - 1e-9)) for k in range(3)]
    last = [int(np.searchsorted(axes[k], high[k] + 1e-9, side="right")) for k in range(3)]
    return slice(first[0], last[0]), slice(first[1], last[1]), slice(first[2], last[2])
