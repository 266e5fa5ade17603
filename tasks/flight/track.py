"""Planned against flown: where the vehicle was, what it photographed, and how far it was off (paper, 4.1)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from schemas.contract import Vector3
from schemas.flight_log import Shot, TrackError, TrackPoint
from schemas.flight_plan import FlightPlan
from schemas.problem import BadInput
from tasks.flight.legs import Legs, distances_m, legs_between, legs_of, mission_corners
from tasks.flight.place import Place
from tasks.flight.recording import Recording
from tasks.flight.shots import match_shots, planned_shots, unnamed_shots

Array = npt.NDArray[np.float64]

AROUND_S = 0.6  # of a shot: how long positions tell its speed
ELSEWHERE_M = 2000.0  # a log this far from the plan belongs to another place


@dataclass(frozen=True)
class Comparison:
    track: tuple[TrackPoint, ...]
    shots: tuple[Shot, ...]
    errors: tuple[TrackError, ...]
    missed: tuple[str, ...]
    duration_s: float
    said: tuple[str, ...] = ()  # what the vehicle warned of, each once


def compare_with_plan(recording: Recording, plan: FlightPlan | None, name: str) -> Comparison:
    """The flown track and shots in world coordinates, times since arming, and against the plan where there
    is one: errors per leg and surface, shots by the planned photos' names, planned photos that are missing.
    """
    fixes = [fix for fix in recording.fixes if _in_flight(fix.time_s, recording)]
    if not fixes:
        raise BadInput(name, "the log holds no position", "Give the log of a flight with satellite reception")
    place = Place.of_plan(plan) if plan is not None else Place.of_log(Recording(fixes=fixes))
    start = recording.armed_s[0][0] if recording.armed_s else fixes[0].time_s
    end = recording.armed_s[-1][1] if recording.armed_s else fixes[-1].time_s
    time_s = np.array([fix.time_s - start for fix in fixes])
    at_m = np.array([place.world_m(fix) for fix in fixes])
    track = tuple(
        TrackPoint(time_s=round(float(t), 3), position_m=_vector(p), yaw_deg=place.yaw_deg(fix))
        for t, p, fix in zip(time_s, at_m, fixes, strict=True)
    )
    duration = round(max(end - start, float(time_s[-1])), 3)
    triggers = [t for t in recording.triggers if _in_flight(t.fix.time_s, recording)]
    said = tuple(dict.fromkeys(text.strip() for t, text in recording.said if _in_flight(t, recording)))
    if plan is None:
        shots = with_velocity(unnamed_shots(triggers, start, place), time_s, at_m)
        return Comparison(track, shots, (), (), duration, said)
    away_m = float(np.linalg.norm(at_m - plan.home_m, axis=1).min())
    if away_m > ELSEWHERE_M:
        raise BadInput(
            name,
            f"the log's flight is {away_m / 1000:.0f} km from the plan",
            "Give the log of this plan's flight, or plan with the origin that was flown",
        )
    corners = mission_corners(plan)
    known = match_shots(plan.shooting_points, triggers, place)
    shooting = [i for i, w in enumerate(plan.waypoints, start=1) if w.kind == "shooting"]
    left_s = {shooting[number]: triggers[t].fix.time_s - start for number, t in known.items()}
    leg = legs_of(at_m, corners, *legs_between(time_s, left_s, last=len(corners) - 2))
    shots, missed = planned_shots(plan, triggers, known, track, leg, start, place)
    errors = _errors(plan, at_m, corners, leg)
    return Comparison(track, with_velocity(shots, time_s, at_m), errors, missed, duration, said)


def with_velocity(shots: Sequence[Shot], time_s: Array, at_m: Array) -> tuple[Shot, ...]:
    """The shots with the slope of the track's positions, (n, 3) at (n,) seconds, around each."""
    known = []
    for shot in shots:
        near = np.abs(time_s - shot.time_s) <= AROUND_S
        slope = None
        if near.any() and time_s[near].min() <= shot.time_s <= time_s[near].max() and near.sum() >= 3:
            fitted = np.polynomial.polynomial.polyfit(time_s[near] - shot.time_s, at_m[near], 1)
            slope = _vector(fitted[1])
        known.append(shot.model_copy(update={"velocity_m_s": slope}))
    return tuple(known)


def _in_flight(time_s: float, recording: Recording) -> bool:
    if not recording.armed_s:
        return True
    return recording.armed_s[0][0] <= time_s <= recording.armed_s[-1][1]


def _errors(plan: FlightPlan, at_m: Array, corners: Array, leg: Legs) -> tuple[TrackError, ...]:
    gap = distances_m(at_m, corners)[np.arange(len(at_m)), leg]
    legs = range(1, len(plan.waypoints) + 1)
    groups = [("flight", list(legs))]
    for surface in dict.fromkeys(w.surface for w in plan.shooting_points if w.surface):
        groups.append((surface, [i for i in legs if plan.waypoints[i - 1].surface == surface]))
    groups += [(f"leg {i}", [i]) for i in legs]
    errors = []
    for what, members in groups:
        gaps = gap[np.isin(leg, members)]
        if len(gaps):
            rms = float(np.sqrt((gaps**2).mean()))
            errors.append(TrackError(what=what, rms_m=rms, largest_m=float(gaps.max())))
    return tuple(errors)


def _vector(values: Array) -> Vector3:
    return (float(values[0]), float(values[1]), float(values[2]))
