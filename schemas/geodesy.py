"""Where the local frame lies on the Earth."""

import math
from collections.abc import Sequence

from pydantic import Field

from schemas.contract import Contract, Vector3
from schemas.problem import BadInput

# WGS84
SEMI_MAJOR_M = 6378137.0
ECCENTRICITY_SQUARED = 6.69437999014e-3

LEAST_APART_M = 5.0  # nearer points give no heading
MOST_RESIDUAL_M = 1.0  # points that contradict each other by more would bring the vehicle too near


class GeoOrigin(Contract):
    """WGS84 position of world (0, 0, 0). World coordinates are east, north, up in metres; where the model's
    frame is turned, "north" is its y axis, which points `heading_deg` clockwise from true north.

    The conversion takes the ellipsoid's radii of curvature at the origin: it is its own inverse, and within
    100 m it errs by at most 2 mm against the exact tangent plane, within 500 m by 5 cm (latitudes to 65°).
    Up is height above the origin's level, as vehicles fly it; the tangent plane lies 2 cm higher at 500 m.
    Where the axes are those of a map grid (UTM), its turn and scale at the origin are undone.
    """

    latitude_deg: float = Field(ge=-89.0, le=89.0)
    longitude_deg: float = Field(ge=-180.0, le=180.0)
    altitude_m: float = 0.0  # above mean sea level
    heading_deg: float = 0.0  # of the world's y axis, clockwise from true north
    grid_scale: float = Field(default=1.0, gt=0)  # world metres per metre on the ellipsoid, of a map grid
    residual_m: float | None = None  # what is left at the worst of the known points that it comes from

    def _metres_per_degree(self) -> tuple[float, float]:
        sin2 = math.sin(math.radians(self.latitude_deg)) ** 2
        w = 1 - ECCENTRICITY_SQUARED * sin2
        north = SEMI_MAJOR_M * (1 - ECCENTRICITY_SQUARED) / w**1.5 + self.altitude_m
        east = (SEMI_MAJOR_M / math.sqrt(w) + self.altitude_m) * math.cos(math.radians(self.latitude_deg))
        return math.radians(1) * north, math.radians(1) * east

    def to_geographic(self, enu_m: Vector3) -> Vector3:
        """Latitude, longitude (degrees), altitude (metres)."""
        north, east = self._metres_per_degree()
        x, y = turned(enu_m[0] / self.grid_scale, enu_m[1] / self.grid_scale, self.heading_deg)
        return self.latitude_deg + y / north, self.longitude_deg + x / east, self.altitude_m + enu_m[2]

    def to_enu(self, latitude_deg: float, longitude_deg: float, altitude_m: float) -> Vector3:
        north, east = self._metres_per_degree()
        x = (longitude_deg - self.longitude_deg) * east * self.grid_scale
        y = (latitude_deg - self.latitude_deg) * north * self.grid_scale
        return *turned(x, y, -self.heading_deg), altitude_m - self.altitude_m

    def compass_deg(self, yaw_deg: float) -> float:
        """The heading, clockwise from true north, of a yaw in the world."""
        return (yaw_deg + self.heading_deg) % 360.0 if self.heading_deg else yaw_deg

    def yaw_deg(self, compass_deg: float) -> float:
        """The yaw in the world of a heading clockwise from true north."""
        return (compass_deg - self.heading_deg) % 360.0 if self.heading_deg else compass_deg


class KnownPoint(Contract):
    """A point of the model whose place on the Earth is known."""

    model_m: Vector3
    latitude_deg: float = Field(ge=-89.0, le=89.0)
    longitude_deg: float = Field(ge=-180.0, le=180.0)
    altitude_m: float | None = None  # above mean sea level


def turned(x: float, y: float, clockwise_deg: float) -> tuple[float, float]:
    """A vector turned clockwise, seen from above."""
    if clockwise_deg == 0.0:
        return x, y
    c, s = math.cos(math.radians(clockwise_deg)), math.sin(math.radians(clockwise_deg))
    return c * x + s * y, c * y - s * x


def anchored(points: Sequence[KnownPoint]) -> GeoOrigin:
    """Origin and heading of a levelled model by least squares from two known points or more. Its residual is
    the largest distance left between a point and its known place, with the height where that is known.

    Two points tell of their distance alone: a point that is off crosswise only turns the model.
    Raises BadInput for points that are too near to each other, or contradict each other by more than 1 m."""
    if len(points) < 2:
        raise BadInput("anchors", "one known point gives no heading", "Give two points, far from each other.")
    first = points[0]
    near = GeoOrigin(latitude_deg=first.latitude_deg, longitude_deg=first.longitude_deg)
    known = [near.to_enu(p.latitude_deg, p.longitude_deg, p.altitude_m or 0.0) for p in points]
    model = [p.model_m for p in points]
    apart_m = min(max(math.dist(a[:2], b[:2]) for a in them for b in them) for them in (known, model))
    if apart_m < LEAST_APART_M:
        raise BadInput(
            "anchors",
            f"the known points lie within {apart_m:.1f} m, too near to each other for a heading",
            f"Give points at least {LEAST_APART_M:g} m apart, better at both ends of the structure.",
        )

    def mean(of: Sequence[Vector3], axis: int) -> float:
        return sum(place[axis] for place in of) / len(of)

    dot = cross = 0.0
    for k, m in zip(known, model, strict=True):
        ex, ey = k[0] - mean(known, 0), k[1] - mean(known, 1)
        mx, my = m[0] - mean(model, 0), m[1] - mean(model, 1)
        dot, cross = dot + ex * mx + ey * my, cross + ex * my - ey * mx
    heading = math.degrees(math.atan2(cross, dot))
    x, y = turned(mean(model, 0), mean(model, 1), heading)
    latitude, longitude, _ = near.to_geographic((mean(known, 0) - x, mean(known, 1) - y, 0.0))
    heights = [p.altitude_m - p.model_m[2] for p in points if p.altitude_m is not None]
    origin = GeoOrigin(
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=sum(heights) / len(heights) if heights else 0.0,
        heading_deg=heading % 360.0,
    )
    residual = 0.0
    for p in points:
        axes = 2 if p.altitude_m is None else 3
        there = origin.to_enu(p.latitude_deg, p.longitude_deg, p.altitude_m or 0.0)
        residual = max(residual, math.dist(there[:axes], p.model_m[:axes]))
    if residual > MOST_RESIDUAL_M:
        raise BadInput(
            "anchors",
            f"the known points contradict each other: {residual:.2f} m are left between a point of the"
            " model and its place on the Earth",
            "Check that latitude, longitude and model_m belong to the same points, in degrees and metres; a"
            " hand-held receiver is not exact enough.",
        )
    return origin.model_copy(update={"residual_m": round(residual, 3)})
