"""How long a flight takes: the vehicle cruises from stop to stop, turns, holds and shoots."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.flight_plan import Waypoint
from schemas.mission import STOP_S
from schemas.vehicle import Vehicle

Array = npt.NDArray[np.float64]

SLOW_BELOW_M, LANDING_M_S = 10.0, 0.5  # as ArduCopter lands


def travel_s(distance_m: npt.ArrayLike, vehicle: Vehicle) -> Array:
    """Seconds from stop to stop with a trapezoidal speed profile (triangular where it is short)."""
    d = np.asarray(distance_m, dtype=float)
    v, a = vehicle.speed_m_s, vehicle.acceleration_m_s2
    return np.where(d < v * v / a, 2 * np.sqrt(d / a), d / v + v / a)


def turn_s(from_yaw_deg: npt.ArrayLike, to_yaw_deg: npt.ArrayLike, vehicle: Vehicle) -> Array:
    """Seconds to turn the nose the shorter way."""
    turn = (np.asarray(to_yaw_deg, dtype=float) - np.asarray(from_yaw_deg, dtype=float) + 180) % 360 - 180
    return np.asarray(np.abs(turn) / vehicle.yaw_rate_deg_s)


def path_length_m(home_m: Vector3, waypoints: Sequence[Waypoint]) -> float:
    places = np.array([home_m, *(w.position_m for w in waypoints), home_m])
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def path_s(path_m: Array, vehicle: Vehicle) -> float:
    """Seconds along the corners (P, 3) of a path, with the stop at each between its ends."""
    stops_s = STOP_S * max(0, len(path_m) - 2)
    return float(travel_s(np.linalg.norm(np.diff(path_m, axis=0), axis=1), vehicle).sum()) + stops_s


def shooting_s(turn: float, on_the_way: float, vehicle: Vehicle, camera: Camera) -> float:
    """Seconds at a shooting point: settling, longer where the turn outlasts the way there, in whole seconds
    as missions hold, and never shorter than the camera's interval."""
    hold = math.ceil(vehicle.hold_s + max(0.0, turn - on_the_way))
    return max(STOP_S, hold, 1.0 / camera.max_rate_hz)


def landing_s(height_m: float) -> float:
    """What landing takes longer than flying down: the last metres are slow."""
    return min(max(height_m, 0.0), SLOW_BELOW_M) / LANDING_M_S


def shot_times_s(
    home_m: Vector3, waypoints: Sequence[Waypoint], vehicle: Vehicle, camera: Camera
) -> tuple[Array, float]:
    """When each photo of a flight is taken, seconds since take-off, and when the last waypoint is left: a
    full stop at every waypoint."""
    seconds, on_the_way = 0.0, 0.0
    here, yaw = np.asarray(home_m), waypoints[0].yaw_deg if waypoints else 0.0
    times: list[float] = []
    for waypoint in waypoints:
        there = np.asarray(waypoint.position_m)
        leg = float(travel_s(np.linalg.norm(there - here), vehicle))
        seconds, on_the_way, here = seconds + leg, on_the_way + leg, there
        if waypoint.kind == "shooting":
            turn = float(turn_s(yaw, waypoint.yaw_deg, vehicle))
            seconds += shooting_s(turn, on_the_way, vehicle, camera)
            times.append(seconds)
            yaw, on_the_way = waypoint.yaw_deg, 0.0
        else:
            seconds += STOP_S
    return np.array(times), seconds


def duration_s(home_m: Vector3, waypoints: Sequence[Waypoint], vehicle: Vehicle, camera: Camera) -> float:
    """Flight time from take-off to landing at home."""
    if not waypoints:
        return 0.0
    last = np.asarray(waypoints[-1].position_m)
    _, seconds = shot_times_s(home_m, waypoints, vehicle, camera)
    down = float(travel_s(np.linalg.norm(last - home_m), vehicle))
    return seconds + down + landing_s(float(last[2]) - home_m[2])
