"""Where the local ENU frame lies on the Earth."""

import math

from pydantic import Field

from schemas.contract import Contract, Vector3

# WGS84
SEMI_MAJOR_M = 6378137.0
ECCENTRICITY_SQUARED = 6.69437999014e-3


class GeoOrigin(Contract):
    """WGS84 position of world (0, 0, 0). Local coordinates are east, north, up in metres.

    The conversion takes the ellipsoid's radii of curvature at the origin: it is its own inverse, and within
    100 m it errs by at most 2 mm against the exact tangent plane, within 500 m by 5 cm (latitudes to 65°).
    Up is height above the origin's level, as vehicles fly it; the tangent plane lies 2 cm higher at 500 m.
    Where the local axes are those of a grid (UTM), its turn and scale at the origin are undone. Headings are
    not turned: they differ by at most 3°.
    """

    latitude_deg: float = Field(ge=-89.0, le=89.0)
    longitude_deg: float = Field(ge=-180.0, le=180.0)
    altitude_m: float = 0.0  # above mean sea level
    grid_north_deg: float = 0.0  # bearing of the local y axis, clockwise from true north
    grid_scale: float = Field(default=1.0, gt=0)  # local metres per metre on the ellipsoid

    def _metres_per_degree(self) -> tuple[float, float]:
        sin2 = math.sin(math.radians(self.latitude_deg)) ** 2
        w = 1 - ECCENTRICITY_SQUARED * sin2
        north = SEMI_MAJOR_M * (1 - ECCENTRICITY_SQUARED) / w**1.5 + self.altitude_m
        east = (SEMI_MAJOR_M / math.sqrt(w) + self.altitude_m) * math.cos(math.radians(self.latitude_deg))
        return math.radians(1) * north, math.radians(1) * east

    def to_geographic(self, enu_m: Vector3) -> Vector3:
        """Latitude, longitude (degrees), altitude (metres)."""
        north, east = self._metres_per_degree()
        turn = math.radians(self.grid_north_deg)
        c, s = math.cos(turn) / self.grid_scale, math.sin(turn) / self.grid_scale
        return (
            self.latitude_deg + (c * enu_m[1] - s * enu_m[0]) / north,
            self.longitude_deg + (c * enu_m[0] + s * enu_m[1]) / east,
            self.altitude_m + enu_m[2],
        )

    def to_enu(self, latitude_deg: float, longitude_deg: float, altitude_m: float) -> Vector3:
        north, east = self._metres_per_degree()
        true_east_m = (longitude_deg - self.longitude_deg) * east
        true_north_m = (latitude_deg - self.latitude_deg) * north
        turn = math.radians(self.grid_north_deg)
        c, s = math.cos(turn) * self.grid_scale, math.sin(turn) * self.grid_scale
        return (
            c * true_east_m - s * true_north_m,
            c * true_north_m + s * true_east_m,
            altitude_m - self.altitude_m,
        )
