"""How long a flight takes: the vehicle cruises from stop to stop, turns, holds and shoots."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from schemas.camera import Camera
from schemas.contract import Vector3
from schemas.flight_plan import Waypoint
from schemas.vehicle import Vehicle

Array = npt.NDArray[np.float64]


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


def duration_s(home_m: Vector3, waypoints: Sequence[Waypoint], vehicle: Vehicle, camera: Camera) -> float:
    """Flight time from take-off to landing at home, a full stop at every waypoint."""
    places = np.array([home_m, *(w.position_m for w in waypoints), home_m])
    seconds = float(travel_s(np.linalg.norm(np.diff(places, axis=0), axis=1), vehicle).sum())
    yaw = waypoints[0].yaw_deg if waypoints else 0.0
    for waypoint in waypoints:
        if waypoint.kind == "shooting":
            seconds += float(turn_s(yaw, waypoint.yaw_deg, vehicle))
            seconds += max(vehicle.hold_s, 1.0 / camera.max_rate_hz)
            yaw = waypoint.yaw_deg
    return seconds
