"""A tour cut into flights: each fits a battery with its reserve and the vehicle's memory, begins and ends at
home, and goes on where the one before stopped."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.flight_plan import Waypoint
from schemas.mission import MOST_ITEMS, STOP_S
from schemas.vehicle import Vehicle
from tasks.planning.route import Stop, Ways
from tasks.planning.timing import landing_s, path_s, shooting_s, turn_s
from tasks.planning.viewpoints import View

Array = npt.NDArray[np.float64]

ITEMS_AROUND = 7  # home, take-off, yaw and stop above home, speed, the way back and the landing
ITEMS_A_SHOT = 3  # waypoint, yaw, trigger; before them a yaw, and the gimbal, where these change
MOST_ITEMS_A_SHOT = 5
ITEMS_A_CORNER = 2
MOST_SHOTS = (MOST_ITEMS - ITEMS_AROUND) // ITEMS_A_SHOT  # of a flight, by the vehicle's memory


class TooFar(Exception):
    """A shooting point from which no battery leads home. number: its place in the tour, from 1."""

    def __init__(self, number: int, seconds: float) -> None:
        super().__init__(number, seconds)
        self.number, self.seconds = number, seconds


class _Home:
    """Ways from shooting points back home, each found once."""

    def __init__(self, stops: list[Stop], ways: Ways) -> None:
        self._stops, self._ways = stops, ways
        self._known: dict[int, Array] = {}

    def way(self, number: int) -> Array:
        if number not in self._known:
            self._known[number] = self._ways.between(self._stops[number], self._stops[0])
        return self._known[number]


def flights(
    stops: list[Stop], ways: Ways, home_m: Vector3, vehicle: Vehicle, camera: Camera
) -> list[tuple[range, list[Array]]]:
    """For each flight the stops that it visits (home is stop 0) and its paths, from above home and back.

    Raises TooFar where a battery does not reach a stop and back."""
    usable = vehicle.endurance_s * (1 - vehicle.reserve)
    between = ways.along(stops[1:])
    home = _Home(stops, ways)
    up_and_down = 2 * (path_s(np.array([home_m, stops[0].place_m]), vehicle) + STOP_S)
    up_and_down += landing_s(float(stops[0].place_m[2]) - home_m[2])
    made = []
    first = 1
    while first < len(stops):
        back, corners = path_s(home.way(first), vehicle), len(home.way(first)) - 1
        seconds = up_and_down + back + shooting_s(0.0, 0.0, vehicle, camera)
        items = ITEMS_AROUND + MOST_ITEMS_A_SHOT + ITEMS_A_CORNER * corners
        if seconds + back > usable:
            raise TooFar(first, seconds + back)
        last = first
        while last + 1 < len(stops):
            path = between[last - 1]
            travel = path_s(path, vehicle)
            turn = float(turn_s(stops[last].yaw_deg, stops[last + 1].yaw_deg, vehicle))
            longer = seconds + travel + shooting_s(turn, travel, vehicle, camera)
            more = items + _items(stops[last], stops[last + 1], len(path) - 2)
            # Back the way it came is a way home; a shorter one is looked for where that is too long.
            back, corners = travel + back, corners + len(path) - 1
            if longer + back > usable or more + ITEMS_A_CORNER * corners > MOST_ITEMS:
                back, corners = path_s(home.way(last + 1), vehicle), len(home.way(last + 1)) - 1
            if longer + back > usable or more + ITEMS_A_CORNER * corners > MOST_ITEMS:
                break
            seconds, items, last = longer, more, last + 1
        made.append(
            (range(first, last + 1), [home.way(first)[::-1], *between[first - 1 : last - 1], home.way(last)])
        )
        first = last + 1
    return made


def _items(here: Stop, there: Stop, corners: int) -> int:
    """Of a mission, from one shot to the next (as `schemas.mission` writes them)."""
    tilts = here.pitch_deg != there.pitch_deg
    turns = tilts or corners > 0 or here.yaw_deg != there.yaw_deg
    return ITEMS_A_SHOT + tilts + turns + ITEMS_A_CORNER * corners


def waypoints_along(paths: Sequence[Array], views: Sequence[View], taken: Counter[str]) -> list[Waypoint]:
    """Waypoints from above home through every shooting point back to above home. `taken` counts the photos
    of each surface through all flights; they are named in order."""
    waypoints: list[Waypoint] = []
    for path, view in zip(paths, [*views, None], strict=True):
        yaw = view.pose.yaw_deg if view else (waypoints[-1].yaw_deg if waypoints else 0.0)
        between = path[:-1] if not waypoints else path[1:-1]
        waypoints += [Waypoint(kind="intermediate", position_m=_rounded(p), yaw_deg=yaw) for p in between]
        if view is None:
            waypoints.append(Waypoint(kind="intermediate", position_m=_rounded(path[-1]), yaw_deg=yaw))
            break
        taken[view.surface] += 1
        waypoints.append(
            Waypoint(
                kind="shooting",
                position_m=view.pose.position_m,
                yaw_deg=yaw,
                pitch_deg=view.pose.pitch_deg,
                surface=view.surface,
                photo=f"{view.surface}-{taken[view.surface]:04d}",
            )
        )
    return waypoints


def _rounded(place: Array) -> Vector3:
    return round(float(place[0]), 4), round(float(place[1]), 4), round(float(place[2]), 4)
