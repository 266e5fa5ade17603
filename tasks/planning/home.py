"""Where the vehicle takes off and lands: a free place on the ground, with a free way up."""

from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from schemas.contract import Vector3
from schemas.problem import BadInput
from tasks.planning.airspace import Airspace
from tasks.planning.allowed import Block
from tasks.planning.astar import Cell
from tasks.planning.occupancy import REACH, VoxelGrid
from tasks.planning.refusals import no_way, no_way_up

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

ROUGH_M = 0.3  # what rises less than this, or less steeply than 20°, is ground to stand on
STEEP = np.tan(np.radians(20.0))
LEAST_CLIMB_M = 2.0  # a vehicle takes off to at least this height
MOST_CLIMB_M = 10.0


@dataclass(frozen=True)
class Base:
    """Where flights begin and end, and what can be reached from there."""

    home_m: Vector3  # on the ground
    top_m: Vector3  # end of the climb
    gate: Cell  # the voxel through which the grid is entered from there
    grid: VoxelGrid
    airspace: Airspace
    _asked: dict[Vector3, Cell | None] = field(default_factory=dict)

    def leads_to(self, place_m: Vector3) -> Cell | None:
        """The voxel through which a free place is entered, where a way leads there."""
        if place_m not in self._asked:
            entrance = self.grid.entrance(np.array(place_m), self.airspace)
            led = entrance is not None and self.grid.component[entrance] == self.grid.component[self.gate]
            self._asked[place_m] = entrance if led else None
        return self._asked[place_m]

    def ways_to(self, places_m: Array) -> Flags:
        """(M,) whether a way leads to each of (M, 3) free places, as far as a look around it says."""
        if not len(places_m):
            return np.zeros(0, dtype=bool)
        return np.asarray(self._within_reach[tuple(self.grid.cells(places_m).T)])

    @cached_property
    def _within_reach(self) -> Flags:
        led_to = self.grid.component == self.grid.component[self.gate]
        return np.asarray(ndimage.binary_dilation(led_to, iterations=REACH))


def home_base(home_m: Vector3 | None, airspace: Airspace, grid: VoxelGrid, places_m: Array) -> Base:
    """The given home, or one that is found as near as possible to the places to visit (N, 3).

    Raises BadInput where there is none, or where no way leads from it to any of the places."""
    entrances = [grid.entrance(place, airspace) for place in places_m]
    components = Counter(int(grid.component[e]) for e in entrances if e is not None)
    if home_m is None:
        home, top = find_home(airspace, grid, components, places_m)
    else:
        home, top = home_m, take_off_place(home_m, airspace)
    gate = grid.entrance(np.array(top), airspace)
    if gate is None or int(grid.component[gate]) not in components:
        raise no_way(home, airspace)
    return Base(home, top, gate, grid, airspace)


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
    if not free.any():
        raise no_way_up(home_m, Block(int(airspace.blocks(places[:1])[0])), airspace)
    top = x, y, float(heights[np.argmax(free)])
    if lowest < top[2]:
        raise no_way_up(home_m, Block.NEAR, airspace)
    if (entered := _entered(home_m, top, airspace)) != Block.FREE:
        raise no_way_up(home_m, entered, airspace)
    return top


def _entered(home_m: Vector3, top_m: Vector3, airspace: Airspace) -> Block:
    """What the climb would enter; the crew that stands at home sees its first metres."""
    if airspace.allowed is None:
        return Block.FREE
    return airspace.allowed.on_the_climb(np.array(home_m), np.array(top_m), home_m[2] + LEAST_CLIMB_M)


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
                home, top = (x, y, z), (x, y, round(float(above[i, 2]), 3))
                if _entered(home, top, airspace) == Block.FREE:
                    return home, top
    raise BadInput(
        "home_m",
        "no free place on the ground was found from which the surfaces can be reached",
        "Give home_m, or lower vehicle.clearance_m or the position error.",
    )


def _apart(places: Array, points: Array) -> Array:
    """(M,) distance of each place to the nearest of the points, inf where there are none."""
    return np.asarray(cKDTree(points).query(places)[0]) if len(points) else np.full(len(places), np.inf)
