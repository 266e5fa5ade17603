"""Where the vehicle's centre may be: exact distance to the scanned points, the height limits, allowed air."""

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tasks.planning.allowed import Allowed, Block
from tasks.planning.ground import Ground, ground_under

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

STEP_M = 0.02  # finest step along a segment
STRIDE_M = 0.5  # longest: the ground's height is known a cell of 1 m at a time


class Airspace:
    """points_m: (N, 3) every scanned point that the vehicle must not meet.

    inflation_m: least distance between the vehicle's centre and any of them; altitudes are above ground, or
    above water where that is higher. allowed: the region that is known to be free; None asks for no region.
    """

    def __init__(
        self,
        points_m: Array,
        inflation_m: float,
        min_altitude_m: float,
        max_altitude_m: float,
        allowed: Allowed | None = None,
        water_m: float | None = None,
    ) -> None:
        self.points_m = points_m
        self.inflation_m = inflation_m
        self.min_altitude_m, self.max_altitude_m = min_altitude_m, max_altitude_m
        self.allowed = allowed
        self.ground: Ground = ground_under(points_m, water_m)
        # Big leaves: the tree keeps no tight boxes, so beside a flat wall it would open thousands of small
        # ones.
        self._tree = cKDTree(points_m, leafsize=256)
        # Half a step more than asked: what holds at samples one step apart then holds between them.
        self._radius_m = inflation_m + STEP_M / 2

    def distance_m(self, places_m: Array, up_to_m: float = np.inf) -> Array:
        """(M,) distance from (M, 3) places to the nearest scanned point; inf beyond `up_to_m`."""
        return np.asarray(
            self._tree.query(
                places_m, distance_upper_bound=up_to_m, workers=2 if len(places_m) > 5000 else 1
            )[0]
        )

    def blocks(self, places_m: Array) -> npt.NDArray[np.int64]:
        """(M,) `Block` of each of (M, 3) places."""
        places = np.atleast_2d(places_m)
        altitude = places[:, 2] - self.ground.at(places)
        block = np.full(len(places), int(Block.FREE))
        if self.allowed is not None:
            block = self.allowed.reasons(places)
        block[altitude > self.max_altitude_m] = Block.HIGH
        block[altitude < self.min_altitude_m] = Block.LOW
        block[self.distance_m(places, self._radius_m) < self._radius_m] = Block.NEAR
        return block

    def is_free(self, places_m: Array) -> Flags:
        places = np.atleast_2d(places_m)
        altitude = places[:, 2] - self.ground.at(places)
        free = (altitude >= self.min_altitude_m) & (altitude <= self.max_altitude_m)
        if self.allowed is not None:
            free &= self.allowed.slack_m(places) >= 0
        free[free] = self.distance_m(places[free], self._radius_m) >= self._radius_m
        return free

    def segments_free(self, starts_m: Array, ends_m: Array) -> Flags:
        """(M,) whether every point of each straight segment is free, by conservative advancement: from a
        place d metres from the nearest point the vehicle may move d − inflation without another look."""
        starts, ends = np.atleast_2d(starts_m), np.atleast_2d(ends_m)
        length = np.linalg.norm(ends - starts, axis=1)
        direction = (ends - starts) / np.maximum(length, 1e-12)[:, None]
        free = np.ones(len(starts), dtype=bool)
        along = np.zeros(len(starts))
        active = np.arange(len(starts))
        while active.size:
            places = starts[active] + along[active, None] * direction[active]
            slack = self.distance_m(places, self._radius_m + STRIDE_M) - self._radius_m
            altitude = places[:, 2] - self.ground.at(places)
            if self.allowed is not None:
                slack = np.minimum(slack, self.allowed.slack_m(places))
            bad = (slack < 0) | (altitude < self.min_altitude_m) | (altitude > self.max_altitude_m)
            free[active[bad]] = False
            arrived = along[active] >= length[active]
            along[active] = np.minimum(along[active] + np.clip(slack, STEP_M, STRIDE_M), length[active])
            active = active[~bad & ~arrived]
        return free
