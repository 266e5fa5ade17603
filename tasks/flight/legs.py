"""Which leg of the planned path each point of a flown track belongs to, and how far it is off it."""

import numpy as np
import numpy.typing as npt

from schemas.flight_plan import FlightPlan

Array = npt.NDArray[np.float64]
Legs = npt.NDArray[np.intp]  # (N,) a leg's number for each point


def mission_corners(plan: FlightPlan) -> Array:
    """(n + 4, 3): home, above it, the n waypoints, above home, home. Leg i ends at waypoint i (from 1)
    and runs from corner i to corner i + 1; leg 0 is the climb, the last two bring it home."""
    home = np.asarray(plan.home_m)
    ways = np.array([w.position_m for w in plan.waypoints]).reshape(-1, 3)
    first = ways[0, 2] if len(ways) else home[2]
    last = ways[-1, 2] if len(ways) else home[2]
    climb = [home[0], home[1], max(first, home[2] + 2.0)]
    return np.vstack([home, climb, ways, [home[0], home[1], last], home])


def distances_m(points_m: Array, corners_m: Array) -> Array:
    """(N, L) distances of N points from the L straight legs between L + 1 corners."""
    start, along = corners_m[:-1], np.diff(corners_m, axis=0)
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    result = np.empty((len(points_m), len(along)))
    for i, (a, d, s) in enumerate(zip(start, along, squared, strict=True)):
        t = np.clip((points_m - a) @ d / s, 0.0, 1.0)
        result[:, i] = np.linalg.norm(points_m - a - t[:, None] * d, axis=1)
    return result


def legs_between(time_s: Array, left_s: dict[int, float], last: int) -> tuple[Legs, Legs]:
    """(N,), (N,) the earliest and latest leg that each moment can be on, where it is known when the ends of
    some legs (keys) were left. last: the highest leg's number."""
    earliest, latest = np.zeros(len(time_s), dtype=np.intp), np.full(len(time_s), last, dtype=np.intp)
    for leg, left in sorted(left_s.items()):
        earliest[time_s > left] = leg + 1
    for leg, left in sorted(left_s.items(), reverse=True):
        latest[time_s <= left] = leg
    return earliest, latest


def legs_of(
    points_m: Array, corners_m: Array, earliest: Legs | None = None, latest: Legs | None = None
) -> Legs:
    """(N,) the leg that each point of a track is on: never backwards, within the limits where such are
    given, least sum of squared distances (dynamic programming, N × L)."""
    cost = distances_m(points_m, corners_m) ** 2
    count, legs = cost.shape
    index = np.arange(legs)
    if earliest is not None and latest is not None:
        cost[(index < earliest[:, None]) | (index > latest[:, None])] = np.inf
    came_from = np.empty((count, legs), dtype=np.int32)
    best = cost[0]
    for i in range(1, count):
        least = np.minimum.accumulate(best)
        came_from[i] = np.maximum.accumulate(np.where(best <= least, index, 0))
        best = cost[i] + least
    leg = np.empty(count, dtype=np.intp)
    leg[-1] = int(np.argmin(best))
    for i in range(count - 1, 0, -1):
        leg[i - 1] = came_from[i, leg[i]]
    return leg
