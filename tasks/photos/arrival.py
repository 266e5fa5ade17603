"""Photos as they arrive while the drone flies: is each good, and which shooting points have none yet?"""

from collections.abc import Mapping, Sequence
from pathlib import PurePath

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from schemas.arrival import Arrival
from schemas.flight_plan import FlightPlan
from schemas.photo import BLURRED, Photo, sharpness_shares

LEAST_TO_COMPARE = 3  # photos, before one can be called less sharp than its neighbours
FAR_SIGMAS = 4.0  # from every shooting point: the photo is of none of them
GPS_SIGMA_M = 0.5  # at least: of a photo's position against the vehicle's own, which EXIF rounds and delays
ANGLE_SIGMA_DEG = 10.0  # of what a gimbal says of its yaw and pitch


def judged(photos: Sequence[Photo], plan: FlightPlan | None) -> tuple[Arrival, ...]:
    """One a photo, in their order of arrival. A photo of which a later one makes a fool is judged anew: all
    are compared with all that there are."""
    names: dict[str, str] = {}
    compared = len(photos) > LEAST_TO_COMPARE
    faults: list[list[str]] = []
    for photo, share in zip(photos, sharpness_shares(photos), strict=True):
        of_photo = []
        twin = names.setdefault(photo.file.sha256, photo.name)
        if twin != photo.name:
            of_photo.append(f"the same picture as {twin}")
        if photo.misexposed:
            of_photo.append(photo.misexposed)
        elif compared and share < BLURRED:
            of_photo.append(f"blurred (sharpness {share:.0%} of its neighbours')")
        faults.append(of_photo)
    if plan is None:
        return tuple(Arrival(name=p.name, faults=tuple(f)) for p, f in zip(photos, faults, strict=True))
    good = [k for k, of_photo in enumerate(faults) if not of_photo]
    point_of, notes = places([photos[k] for k in good], plan)
    arrivals = []
    for k, photo in enumerate(photos):
        note = notes.get(photo.name, "") if k in good else ""
        arrivals.append(
            Arrival(
                name=photo.name,
                faults=tuple(faults[k]) or ((note,) if note.startswith("wrong place") else ()),
                note="" if note.startswith("wrong place") else note,
                point=point_of.get(photo.name) if k in good else None,
            )
        )
    return tuple(arrivals)


def places(photos: Sequence[Photo], plan: FlightPlan) -> tuple[Mapping[str, str], Mapping[str, str]]:
    """The shooting point of each photo, and a word on those that have none or lie oddly.

    By the planned name where the file carries it; else by GPS and gimbal, each point with one photo and the
    sum of squared deviations, in sigmas, the least; else in order, as cameras count upwards."""
    points = [w.photo or f"shot-{k:04d}" for k, w in enumerate(plan.shooting_points, start=1)]
    point_of = {p.name: PurePath(p.name).stem for p in photos if PurePath(p.name).stem in points}
    notes: dict[str, str] = {}
    unnamed = [p for p in photos if p.name not in point_of]
    located = [p for p in unnamed if p.gps is not None]
    open_points = [k for k, point in enumerate(points) if point not in point_of.values()]
    if located:
        squares = _deviations(located, plan)
        for row, photo in enumerate(located):
            if squares[row].min() > FAR_SIGMAS**2:
                notes[photo.name] = f"wrong place: {_nearest(photo, plan, points)}"
        rows, columns = linear_sum_assignment(np.minimum(squares[:, open_points], FAR_SIGMAS**2))
        for row, column in zip(rows, columns, strict=True):
            photo, k = located[row], open_points[column]
            if photo.name not in notes and squares[row, k] <= FAR_SIGMAS**2:
                point_of[photo.name] = points[k]
        for photo in located:
            if photo.name not in point_of and photo.name not in notes:
                notes[photo.name] = "one more of a shooting point that has its photo"
    taken = set(point_of.values())
    free = [point for point in points if point not in taken]
    for photo in (p for p in unnamed if p.gps is None):
        if free:
            point_of[photo.name] = free.pop(0)
            notes[photo.name] = "placed by order: it has neither the plan's name nor GPS"
        else:
            notes[photo.name] = "one more than the plan's shooting points"
    return point_of, notes


def missing(arrivals: Sequence[Arrival], plan: FlightPlan) -> tuple[str, ...]:
    """The shooting points that have no good photo yet, in the order of the flight."""
    taken = {arrival.point for arrival in arrivals if not arrival.faults}
    points = [w.photo or f"shot-{k:04d}" for k, w in enumerate(plan.shooting_points, start=1)]
    return tuple(point for point in points if point not in taken)


def _position(photo: Photo, plan: FlightPlan) -> npt.NDArray[np.float64]:
    """(3,) world ENU, metres; up is NaN where the photo does not tell."""
    latitude, longitude, above_home = photo.gps or (0.0, 0.0, 0.0)
    east, north, _ = plan.origin.to_enu(latitude, longitude, plan.origin.altitude_m)
    return np.array([east, north, plan.home_m[2] + above_home if above_home else np.nan])


def _deviations(photos: Sequence[Photo], plan: FlightPlan) -> npt.NDArray[np.float64]:
    """(N, points) squared deviations in sigmas, the largest of place, yaw and pitch."""
    vehicle = plan.vehicle
    sigma = max(float(np.hypot(vehicle.position_bias_m, vehicle.position_jitter_m)), GPS_SIGMA_M)
    at = np.array([w.position_m for w in plan.shooting_points])
    aim = np.array([(w.yaw_deg, w.pitch_deg) for w in plan.shooting_points])
    squares = []
    for photo in photos:
        off = np.nan_to_num((at - _position(photo, plan)) / sigma)
        square = (off**2).sum(axis=1)
        if photo.view_deg is not None:
            yaw, pitch = ((aim - photo.view_deg[:2] + 180) % 360 - 180).T / ANGLE_SIGMA_DEG
            steep = np.abs(aim[:, 1]) > 80  # looking straight up or down, yaw only turns the image
            square = np.maximum(square, np.maximum(np.where(steep, 0.0, yaw**2), pitch**2))
        squares.append(square)
    return np.array(squares)


def _nearest(photo: Photo, plan: FlightPlan, points: Sequence[str]) -> str:
    """How far from which shooting point, and how far turned away."""
    at = np.array([w.position_m for w in plan.shooting_points])
    off_m = np.linalg.norm(np.nan_to_num(at - _position(photo, plan)), axis=1)
    nearest = int(off_m.argmin())
    waypoint, words = plan.shooting_points[nearest], f"{off_m[nearest]:.1f} m from {points[nearest]}"
    if photo.view_deg is None:
        return words
    yaw = abs((waypoint.yaw_deg - photo.view_deg[0] + 180) % 360 - 180)
    turned = max(yaw, abs(waypoint.pitch_deg - photo.view_deg[1]))
    return f"{words}, turned by {turned:.0f}°" if turned > FAR_SIGMAS * ANGLE_SIGMA_DEG else words
