"""Surfaces and obstacles of a structure: what planning needs to know about the world."""

import math
from collections.abc import Sequence

from schemas.contract import Contract, Vector3
from schemas.file import File
from schemas.geodesy import GeoOrigin, KnownPoint, anchored
from schemas.obstacle import Obstacle
from schemas.problem import BadInput, LeftOut
from schemas.scan_window import ScanWindow
from schemas.surface import Surface
from schemas.utm import UtmZone, utm_origin

FARTHEST_M = 1000.0  # from the scanned world: a known point beyond is none of it


class Structure(Contract):
    surfaces: tuple[Surface, ...]
    obstacles: tuple[Obstacle, ...]
    occupied: File  # PLY, float32 metres: every point that a vehicle must not meet, voxelised
    min_m: Vector3  # extent of the scanned world
    max_m: Vector3
    stations_m: tuple[Vector3, ...] = ()  # where scanners stood; none where that is not known
    windows: tuple[ScanWindow, ...] = ()  # of each of these, where it looked; none where that is not known
    world_origin_m: Vector3 = (0.0, 0.0, 0.0)  # all places here + this = world (UTM or another large grid)
    utm_zone: UtmZone | None = None  # of that world, where it is known
    left_out: tuple[LeftOut, ...] = ()

    def geo_origin(self, utm_zone: str | None = None) -> GeoOrigin | None:
        """WGS84 of (0, 0, 0), by the zone given or else known; None without one. BadInput where the model
        does not lie in it."""
        zone = utm_zone or self.utm_zone
        return None if zone is None else utm_origin(zone, self.world_origin_m)

    def origin_as_stated(self, origin: GeoOrigin) -> GeoOrigin:
        """A stated WGS84 place of the scans' (0, 0, 0). BadInput where their coordinates are so large that
        they were shifted: no plane that touches the Earth there holds a mission here."""
        if any(self.world_origin_m):
            away_km = math.hypot(*self.world_origin_m) / 1000
            raise BadInput(
                "origin",
                f"says where (0, 0, 0) of the scans lies, but they lie {away_km:,.0f} km from it: no mission"
                " can be placed from there",
                "Give the zone of their map grid (utm_zone: 32N), or two known points (anchors)",
            )
        return origin

    def anchored(self, points: Sequence[KnownPoint]) -> GeoOrigin:
        """The origin that known points tell, given as the model or, where it was shifted, as the scans have
        them. BadInput for a point that is far from both, and as `geodesy.anchored` says."""
        return anchored([self._of_the_model(point) for point in points])

    def _of_the_model(self, point: KnownPoint) -> KnownPoint:
        (here,) = self.here("anchors", (point.model_m,))
        return point.model_copy(update={"model_m": here})

    def here(self, stated: str, places_m: Sequence[Vector3]) -> tuple[Vector3, ...]:
        """The corners of something that somebody stated, in the model's coordinates: as they are or, where
        the model was shifted and they lie nearer then, as the scans have them. BadInput, naming `stated`, for
        what lies far from the model either way."""
        shifted = tuple(_less(place, self.world_origin_m) for place in places_m)
        nearest = min((tuple(places_m), shifted), key=self._away_m)
        if (away_m := self._away_m(nearest)) > FARTHEST_M:
            raise BadInput(
                stated,
                f"what was given at {places_m[0]} lies {away_m / 1000:,.0f} km from the model",
                "Give metres in the coordinates of the scans",
            )
        return nearest

    def _away_m(self, corners_m: Sequence[Vector3]) -> float:
        """From the scanned world, both taken for boxes."""
        box = zip(*corners_m, strict=True)
        outside = zip(self.min_m, ((min(axis), max(axis)) for axis in box), self.max_m, strict=True)
        return math.hypot(*(max(low - far, near - high, 0.0) for low, (near, far), high in outside))


def _less(a: Vector3, b: Vector3) -> Vector3:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
