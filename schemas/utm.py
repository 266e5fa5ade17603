"""UTM, the grid in which surveyors state large coordinates."""

import math
import re
from typing import Annotated

from pydantic import Field

from schemas.contract import Vector3
from schemas.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M, GeoOrigin
from schemas.problem import BadInput

UTM_ZONE = r"^([1-9]|[1-5][0-9]|60)[NS]$"
UtmZone = Annotated[str, Field(pattern=UTM_ZONE)]  # such as 32N

CENTRAL_SCALE = 0.9996
FALSE_EAST_M, FALSE_NORTH_M = 500_000.0, 10_000_000.0  # the latter in the south
EAST_M, NORTH_M = (100_000.0, 900_000.0), (0.0, 10_000_000.0)  # of every zone
_ZONES_OF_EPSG = {
    326: ("N", range(1, 61)), 327: ("S", range(1, 61)), 258: ("N", range(28, 39)), 269: ("N", range(1, 24)),
}  # fmt: skip
_N = (1 - math.sqrt(1 - ECCENTRICITY_SQUARED)) / (1 + math.sqrt(1 - ECCENTRICITY_SQUARED))
_RADIUS_M = SEMI_MAJOR_M / (1 + _N) * (1 + _N**2 / 4 + _N**4 / 64)
_BETA = (
    _N / 2 - 2 * _N**2 / 3 + 37 * _N**3 / 96,
    _N**2 / 48 + _N**3 / 15,
    17 * _N**3 / 480,
)
_DELTA = (2 * _N - 2 * _N**2 / 3 - 2 * _N**3, 7 * _N**2 / 3 - 8 * _N**3 / 5, 56 * _N**3 / 15)


def utm_origin(zone: str, place_m: Vector3) -> GeoOrigin:
    """The origin of a local frame at an (east, north, up) of a zone, its axes those of the grid.

    By Krüger's series to the third order (0.1 mm). Heights are taken for metres above mean sea level. Raises
    BadInput for a place that no zone has.
    """
    east_m, north_m, up_m = place_m
    if not (EAST_M[0] <= east_m <= EAST_M[1] and NORTH_M[0] <= north_m <= NORTH_M[1]):
        raise BadInput(
            "utm_zone",
            f"east {east_m:.0f} m, north {north_m:.0f} m, where the model lies, is no place of a UTM zone",
            "Leave it out and state the origin's latitude and longitude.",
        )
    south = FALSE_NORTH_M if zone.endswith("S") else 0.0
    xi = (north_m - south) / (CENTRAL_SCALE * _RADIUS_M)
    eta = (east_m - FALSE_EAST_M) / (CENTRAL_SCALE * _RADIUS_M)
    x, y, dx, dy = xi, eta, 1.0, 0.0
    for j, beta in enumerate(_BETA, start=1):
        x -= beta * math.sin(2 * j * xi) * math.cosh(2 * j * eta)
        y -= beta * math.cos(2 * j * xi) * math.sinh(2 * j * eta)
        dx -= 2 * j * beta * math.cos(2 * j * xi) * math.cosh(2 * j * eta)
        dy += 2 * j * beta * math.sin(2 * j * xi) * math.sinh(2 * j * eta)
    chi = math.asin(math.sin(x) / math.cosh(y))
    latitude = chi + sum(delta * math.sin(2 * j * chi) for j, delta in enumerate(_DELTA, start=1))
    middle_deg = 6 * int(zone[:-1]) - 183
    turn = math.tan(x) * math.tanh(y)
    flatter = (1 - _N) / (1 + _N) * math.tan(latitude)
    stretch = (1 + flatter**2) * (math.cos(x) ** 2 + math.sinh(y) ** 2) / (dx**2 + dy**2)
    return GeoOrigin(
        latitude_deg=math.degrees(latitude),
        longitude_deg=middle_deg + math.degrees(math.atan2(math.sinh(y), math.cos(x))),
        altitude_m=up_m,
        heading_deg=math.degrees(math.atan2(dy + dx * turn, dx - dy * turn)),
        grid_scale=CENTRAL_SCALE * _RADIUS_M / SEMI_MAJOR_M * math.sqrt(stretch),
    )


def zone_in(crs: str) -> str | None:
    """The zone that the name of a coordinate system (WKT) states, in either order of number and letter."""
    found = re.search(r"UTM[ _]zone[ _]([1-9]|[1-5][0-9]|60)([NS])\b", crs, re.IGNORECASE)
    return found[1] + found[2].upper() if found else None


def zone_of_epsg(code: int) -> str | None:
    """WGS84 (326…, 327…), ETRS89 (258…) and NAD83 (269…): within a metre of each other. NAD83's further
    numbers are state planes."""
    hemisphere, zones = _ZONES_OF_EPSG.get(code // 100, ("", range(0)))
    return f"{code % 100}{hemisphere}" if code % 100 in zones else None
