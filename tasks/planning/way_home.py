"""The height at which a failsafe may bring the vehicle home.

ArduCopter's RTL (mode_rtl.cpp) climbs where it is to RTL_ALT above home, unless it is higher already, flies
straight home at that height and comes down there. Near home it climbs less: 3 m for each metre of distance
(RTL_CONE_SLOPE)."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from schemas.contract import Vector3
from schemas.flight_plan import Flight, Waypoint
from tasks.planning.airspace import Airspace

Array = npt.NDArray[np.float64]

LEAST_M, CONE = 2.0, 3.0  # RTL_ALT_MIN and RTL_CONE_SLOPE, as delivered
EVERY_M = 1.0  # along the flights: a failsafe may come anywhere
RISE_M = 0.5  # between the heights that are tried
OVER_M = 2.0  # above the highest thing and the inflation: no way is freer than that one
FIRST_LOOK = 16  # of so many places one is looked at first


def return_height_m(
    waypoints: Sequence[Waypoint],
    flights: Sequence[Flight],
    home_m: Vector3,
    top_m: Vector3,
    airspace: Airspace,
) -> float | None:
    """The least RTL_ALT, in metres above home, with which the way home is through known air from everywhere
    on the flights; None where no height is. top_m: end of the climb from home, which is known to be free."""
    places = np.concatenate([_along(waypoints[f.first : f.last + 1], top_m) for f in flights])
    highest_m = max(places[:, 2].max(), airspace.points_m[:, 2].max()) + airspace.inflation_m + OVER_M
    for height_m in np.arange(LEAST_M, highest_m - home_m[2], RISE_M):
        if all(_all_free(some, height_m, home_m, top_m, airspace) for some in (places[::FIRST_LOOK], places)):
            return float(height_m)
    return None


def _along(waypoints: Sequence[Waypoint], top_m: Vector3) -> Array:
    """(N, 3) places EVERY_M apart, or closer, from the end of the climb through the waypoints and back."""
    corners = np.array([top_m, *(w.position_m for w in waypoints), top_m])
    parts = [corners[:1]]
    for a, b in pairwise(corners):
        n = max(1, int(np.ceil(np.linalg.norm(b - a) / EVERY_M)))
        parts.append(a + (np.arange(1, n + 1) / n)[:, None] * (b - a))
    return np.concatenate(parts)


def _all_free(places: Array, height_m: float, home_m: Vector3, top_m: Vector3, airspace: Airspace) -> bool:
    away_m = np.linalg.norm(places[:, :2] - home_m[:2], axis=1)
    climbed, over, down = places.copy(), places.copy(), places.copy()
    climbed[:, 2] = np.maximum(places[:, 2], home_m[2] + np.minimum(height_m, CONE * away_m))
    over[:, :2], over[:, 2] = home_m[:2], climbed[:, 2]
    down[:, :2], down[:, 2] = home_m[:2], np.minimum(climbed[:, 2], top_m[2])
    lowest, highest = down[[np.argmin(down[:, 2])]], over[[np.argmax(over[:, 2])]]
    return bool(
        airspace.segments_free(highest, lowest).all()
        and airspace.segments_free(places, climbed).all()
        and airspace.segments_free(climbed, over).all()
    )
