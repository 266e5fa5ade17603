"""Which exposure took which planned photo, and where those were taken that nobody reported."""

import numpy as np

from schemas.camera import CameraPose
from schemas.flight_log import Shot, TrackPoint
from schemas.flight_plan import FlightPlan, Waypoint
from tasks.flight.legs import Legs
from tasks.flight.place import Place
from tasks.flight.recording import Trigger

SKIP_M = 2.0  # a shot farther than this from a planned point is another shot, unless order says otherwise
PASSED_M = 1.0  # a planned point passed no closer, or not even half the way there, was not shot
LINGER_M, LINGER_DEG = 0.05, 2.0  # at the trigger, the end of the hold, it is still about this near its best


def unnamed_shots(triggers: list[Trigger], start_s: float, place: Place) -> tuple[Shot, ...]:
    """The shots of a flight without a plan: shot-0001, shot-0002, …"""
    return tuple(
        _shot(f"shot-{number:04d}", None, trigger, start_s, place, trigger.pitch_deg)
        for number, trigger in enumerate(triggers, start=1)
    )


def match_shots(planned: tuple[Waypoint, ...], triggers: list[Trigger], place: Place) -> dict[int, int]:
    """Which trigger took which planned photo, both counted from 0: in order, least distance, where leaving
    out a planned photo or a trigger costs SKIP_M (Needleman-Wunsch alignment)."""
    if not planned or not triggers:
        return {}
    a = np.array([w.position_m for w in planned])
    b = np.array([place.world_m(t.fix) for t in triggers])
    gap = np.linalg.norm(a[:, None] - b[None], axis=2)
    rows, columns = gap.shape
    best = np.empty((rows + 1, columns + 1))
    best[:, 0] = SKIP_M * np.arange(rows + 1)
    best[0] = SKIP_M * np.arange(columns + 1)
    for i in range(1, rows + 1):
        both = best[i - 1, :-1] + gap[i - 1]
        drop = best[i - 1, 1:] + SKIP_M
        row = np.concatenate([[best[i, 0]], np.minimum(both, drop)])
        steps = SKIP_M * np.arange(columns + 1)  # row[j] = min over k ≤ j of row[k] + (j − k)·SKIP_M
        best[i] = np.minimum.accumulate(row - steps) + steps
    found: dict[int, int] = {}
    i, j = rows, columns
    while i and j:
        if np.isclose(best[i, j], best[i - 1, j - 1] + gap[i - 1, j - 1]):
            i, j = i - 1, j - 1
            found[i] = j
        elif np.isclose(best[i, j], best[i - 1, j] + SKIP_M):
            i -= 1
        else:
            j -= 1
    return found


def planned_shots(
    plan: FlightPlan,
    triggers: list[Trigger],
    known: dict[int, int],
    track: tuple[TrackPoint, ...],
    leg: Legs,
    start_s: float,
    place: Place,
) -> tuple[tuple[Shot, ...], tuple[str, ...]]:
    """The shots of the planned photos: as reported, else from the track where the vehicle's own count of
    exposures allows that a message was lost."""
    shots: list[Shot] = []
    missed: list[str] = []
    number = -1
    for index, way in enumerate(plan.waypoints, start=1):
        if way.kind != "shooting":
            continue
        number += 1
        photo = way.photo or f"photo-{number + 1:04d}"
        if number in known:
            trigger = triggers[known[number]]
            shots.append(_shot(photo, way.surface, trigger, start_s, place, way.pitch_deg))
            continue
        at = _left(track, leg, index, plan) if _may_be_lost(number, known, triggers) else None
        if at is None:
            missed.append(photo)
            continue
        pose = CameraPose(position_m=at.position_m, yaw_deg=at.yaw_deg, pitch_deg=way.pitch_deg)
        shots.append(Shot(photo=photo, surface=way.surface, time_s=at.time_s, pose=pose, reported=False))
    return tuple(shots), tuple(missed)


def _may_be_lost(number: int, known: dict[int, int], triggers: list[Trigger]) -> bool:
    """Whether the vehicle counted an exposure between the reported ones around this planned photo."""
    before = max((n for n in known if n < number), default=None)
    after = min((n for n in known if n > number), default=None)
    if before is None or after is None:
        return True
    first, last = triggers[known[before]].index, triggers[known[after]].index
    if first is None or last is None:
        return True
    return last - first - 1 > known[after] - known[before] - 1


def _left(track: tuple[TrackPoint, ...], leg: Legs, index: int, plan: FlightPlan) -> TrackPoint | None:
    """Where the vehicle was when it left the plan's waypoint `index` (from 1), or None where it never was
    there: the last of the fixes that are nearest to it in place and heading."""
    near = np.flatnonzero((leg == index) | (leg == index + 1))
    if not len(near):
        return None
    way = plan.waypoints[index - 1]
    before = plan.waypoints[index - 2].position_m if index > 1 else plan.home_m
    gap = np.linalg.norm([np.subtract(track[i].position_m, way.position_m) for i in near], axis=1)
    if gap.min() > min(PASSED_M, max(float(np.linalg.norm(np.subtract(way.position_m, before))) / 2, 0.1)):
        return None
    near = near[gap <= gap.min() + LINGER_M]
    turn = np.abs([(track[i].yaw_deg - way.yaw_deg + 180.0) % 360.0 - 180.0 for i in near])
    return track[int(near[turn <= turn.min() + LINGER_DEG][-1])]


def _shot(
    photo: str, surface: str | None, trigger: Trigger, start_s: float, place: Place, pitch_deg: float
) -> Shot:
    """The pitch is the plan's where there is one: autopilots report their own, not the gimbal's."""
    return Shot(
        photo=photo,
        surface=surface,
        time_s=round(trigger.fix.time_s - start_s, 3),
        pose=CameraPose(
            position_m=place.world_m(trigger.fix), yaw_deg=place.yaw_deg(trigger.fix), pitch_deg=pitch_deg
        ),
    )
