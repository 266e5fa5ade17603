"""Surfaces and obstacles of a structure: what planning needs to know about the world."""

from schemas.contract import Contract, Vector3
from schemas.file import File
from schemas.geodesy import GeoOrigin
from schemas.obstacle import Obstacle
from schemas.problem import LeftOut
from schemas.surface import Surface
from schemas.utm import UtmZone, utm_origin


class Structure(Contract):
    surfaces: tuple[Surface, ...]
    obstacles: tuple[Obstacle, ...]
    occupied: File  # PLY, float32 metres: every point that a vehicle must not meet, voxelised
    min_m: Vector3  # extent of the scanned world
    max_m: Vector3
    stations_m: tuple[Vector3, ...] = ()  # where scanners stood; none where that is not known
    world_origin_m: Vector3 = (0.0, 0.0, 0.0)  # all places here + this = world (UTM or another large grid)
    utm_zone: UtmZone | None = None  # of that world, where it is known
    left_out: tuple[LeftOut, ...] = ()

    def geo_origin(self, utm_zone: str | None = None) -> GeoOrigin | None:
        """WGS84 of (0, 0, 0), by the zone given or else known; None without one. BadInput where the model
        does not lie in it."""
        zone = utm_zone or self.utm_zone
        return None if zone is None else utm_origin(zone, self.world_origin_m)
