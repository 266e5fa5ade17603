"""Where the vehicle takes off and lands: a free place on the ground, with a free way up."""

from collections import Counter

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from schemas.contract import Vector3
from schemas.problem import BadInput
from tasks.planning.airspace import Airspace
from tasks.planning.occupancy import VoxelGrid

Array = npt.NDArray[np.float64]

ROUGH_M = 0.3  # what rises less than this, or less steeply than 20°, is ground to stand on
STEEP = np.tan(np.radians(20.0))
LEAST_CLIMB_M = 2.0  # a vehicle takes off to at least this height
MOST_CLIMB_M = 10.0


def take_off_place(home_m: Vector3, airspace: Airspace) -> Vector3:
    """Where the climb from a given home ends: the lowest free place above it. Refuses a home that lies in,
    under or too close beside something."""
    x, y, z = home_m
    if z < float(airspace.ground.at(np.array(home_m))) - 1.0:
        raise BadInput(
            "home_m", f"({x:g}, {y:g}, {z:g}) lies under the ground", "Give a place on the ground."
        )
    heights = np.arange(z + LEAST_CLIMB_M, z + MOST_CLIMB_M, 0.25)
    places = np.column_stack([np.full_like(heights, x), np.full_like(heights, y), heights])
    free = airspace.is_free(places)
    aside = np.linalg.norm(airspace.points_m[:, :2] - (x, y), axis=1)
    near = aside < airspace.inflation_m
    rise = airspace.points_m[near, 2] - z
    in_the_way = rise[rise > ROUGH_M + STEEP * aside[near]]
    lowest = float(in_the_way.min()) + z if in_the_way.size else np.inf
    if not free.any() or lowest < heights[np.argmax(free)]:
        raise BadInput(
            "home_m",
            f"there is no free way up from ({x:g}, {y:g}, {z:g}): something is closer than"
            f" {airspace.inflation_m:.2f} m (radius, clearance and position error)",
            "Give a place on open ground, or leave home_m out and one is found.",
        )
    return x, y, float(heights[np.argmax(free)])


def find_home(
    airspace: Airspace, grid: VoxelGrid, entrances: Counter[int], around_m: Array
) -> tuple[Vector3, Vector3]:
    """Home on the ground and the end of its climb, as near as possible to the places to visit (N, 3).

    entrances: how many places each component of free space leads to; the home leads to as many as it can.
    Scanned ground under open sky is taken first, then under a roof, then ground that nobody scanned.
    """
    ground, scanned = airspace.ground.places_m()
    height = airspace.points_m[:, 2] - airspace.ground.at(airspace.points_m)
    climb = max(LEAST_CLIMB_M, airspace.inflation_m + 0.1)
    tall = airspace.points_m[height > ROUGH_M, :2]
    low = airspace.points_m[(height > ROUGH_M) & (height < climb), :2]
    open_sky = _apart(ground[:, :2], tall) >= airspace.inflation_m
    free_beside = _apart(ground[:, :2], low) >= airspace.inflation_m
    rank = np.select([scanned & open_sky, scanned & free_beside, free_beside], [0, 1, 2], default=3)
    above = ground + np.array([0.0, 0.0, climb])
    middle = around_m[:, :2].mean(axis=0)
    away = np.linalg.norm(ground[:, :2] - middle, axis=1)
    extent = grid.centres_m(np.array(grid.free.shape) - 1)
    in_grid = np.all((above >= grid.low_m) & (above <= extent), axis=1)
    candidates = np.flatnonzero((rank < 3) & in_grid)
    candidates = candidates[airspace.is_free(above[candidates])] if candidates.size else candidates
    candidates = candidates[np.lexsort((away[candidates], rank[candidates]))]
    leads_to: dict[int, int | None] = {}  # component of each candidate, asked once
    for component, _ in entrances.most_common():
        for i in candidates.tolist():
            if i not in leads_to:
                gate = grid.entrance(above[i], airspace)
                leads_to[i] = None if gate is None else int(grid.component[gate])
            if leads_to[i] == component:
                x, y, z = (round(float(a), 3) for a in ground[i])
                return (x, y, z), (x, y, round(float(above[i, 2]), 3))
    raise BadInput(
        "home_m",
        "no free place on the ground was found from which the surfaces can be reached",
        "Give home_m, or lower vehicle.clearance_m or the position error.",
    )


def _apart(places: Array, points: Array) -> Array:
    """(M,) distance of each place to the nearest of the points, inf where there are none."""
    return np.asarray(cKDTree(points).query(places)[0]) if len(points) else np.full(len(places), np.inf)
