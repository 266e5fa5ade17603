"""The path through all shooting points: visiting order, A* where the straight way is blocked, smoothed."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.astar import Cell, PathFinder
from tasks.planning.occupancy import VoxelGrid
from tasks.planning.smoothing import shortcut
from tasks.planning.timing import travel_s, turn_s
from tasks.planning.tour import Order, visiting_order

Array = npt.NDArray[np.float64]

CHANGE_S = 5.0  # what it may cost to finish a surface first: its photos then share the walking bias
NEIGHBOURS = 16  # a tour seldom joins points that are not among each other's nearest


@dataclass(frozen=True)
class Stop:
    """A place to visit: the take-off place, or a shooting point."""

    place_m: Array  # (3,)
    yaw_deg: float
    entrance: Cell  # the voxel through which it is reached
    surface: str = ""
    pitch_deg: float = 0.0


def flying_order(stops: list[Stop], start: Order, vehicle: Vehicle, airspace: Airspace) -> Order:
    """Order of the stops, the first (take-off) staying first, short in flight time."""
    places = np.array([s.place_m for s in stops])
    yaw = np.array([s.yaw_deg for s in stops])
    surface = np.unique([s.surface for s in stops], return_inverse=True)[1]
    blocked = _blocked_neighbours(places, airspace)

    def seconds_between(some: Order) -> Array:
        apart = np.linalg.norm(places[some, None] - places[None, some], axis=2)
        # A detour's length is known only after its search: about half as long again, and round the corner.
        way = apart + blocked[np.ix_(some, some)] * (0.5 * apart + 4.0 * airspace.inflation_m)
        turn = turn_s(yaw[some, None], yaw[None, some], vehicle)
        turn[some == 0] = turn[:, some == 0] = 0.0  # the nose may point anywhere above home
        change = CHANGE_S * (surface[some, None] != surface[None, some])
        return np.asarray(travel_s(way, vehicle) + turn + change)

    return visiting_order(start, seconds_between)


def _blocked_neighbours(places: Array, airspace: Airspace) -> npt.NDArray[np.bool_]:
    """(N, N) whether the straight way between two near stops is blocked; far ones are not looked at."""
    count = min(NEIGHBOURS + 1, len(places))
    near = np.asarray(cKDTree(places).query(places, k=count)[1]).reshape(len(places), count)
    pairs = np.column_stack([np.repeat(np.arange(len(places)), count), near.ravel()])
    pairs = np.unique(np.sort(pairs, axis=1)[pairs[:, 0] != pairs[:, 1]], axis=0)
    blocked = np.zeros((len(places), len(places)), dtype=bool)
    if len(pairs):
        bad = pairs[~airspace.segments_free(places[pairs[:, 0]], places[pairs[:, 1]])]
        blocked[bad[:, 0], bad[:, 1]] = blocked[bad[:, 1], bad[:, 0]] = True
    return blocked


class Ways:
    """Ways between stops: straight where that is free, else found by A* and smoothed."""

    def __init__(self, grid: VoxelGrid, airspace: Airspace, weights: tuple[float, float, float]) -> None:
        self._grid, self._airspace = grid, airspace
        self._finder = PathFinder(grid.free, weights)

    def between(self, start: Stop, goal: Stop) -> Array:
        """(P, 3) from start to goal, both included."""
        return self.along([start, goal])[0]

    def along(self, stops: list[Stop]) -> list[Array]:
        """For each stop but the last: the path (P, 3) to the next, both ends included."""
        places = np.array([s.place_m for s in stops])
        straight = self._airspace.segments_free(places[:-1], places[1:])
        paths = []
        for start, goal, direct in zip(stops, stops[1:], straight, strict=False):
            if direct:  # what the search would find and the smoothing make of it
                paths.append(np.array([start.place_m, goal.place_m]))
                continue
            found = self._finder.path(start.entrance, goal.entrance)
            assert found is not None, "both entrances lie in one component"
            path = np.vstack([start.place_m, self._grid.centres_m(found[0]), goal.place_m])
            paths.append(shortcut(path, self._airspace))
        return paths
