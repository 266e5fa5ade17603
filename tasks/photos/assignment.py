"""Which photo is which shot of a flight log."""

import re
from collections.abc import Mapping
from pathlib import PurePath

from schemas.assigned_shot import AssignedShot
from schemas.flight_log import FlightLog, Shot
from schemas.problem import BadInput


def assign_shots(taken_s: Mapping[str, float | None], log: FlightLog) -> tuple[AssignedShot, ...]:
    """Match photos to the log's shots: by the planned photo's name where the files carry it, else in the
    order in which they were taken, which needs as many photos as shots.

    taken_s: of each photo, by its folder/name, when it was taken by the camera's clock, None where it does
    not say; folders in the order in which they were filled. Raises BadInput where neither fits, since a
    shifted match puts every crack in a wrong place.
    """
    by_name = {shot.photo: shot for shot in log.shots}
    named = tuple(
        AssignedShot(name=name, shot=by_name[PurePath(name).stem])
        for name in taken_s
        if PurePath(name).stem in by_name
    )
    if named:
        return named
    if len(taken_s) == len(log.shots):
        return tuple(
            AssignedShot(name=name, shot=shot)
            for name, shot in zip(_as_taken(taken_s), _in_time(log), strict=True)
        )
    raise BadInput(
        "photos",
        f"there are {len(taken_s)} photos but the flight log has {len(log.shots)} shots",
        "Take out photos that were not shot by the mission, or name them as the plan does",
    )


def _as_taken(taken_s: Mapping[str, float | None]) -> list[str]:
    """By the camera's clock, since its counter starts anew after 9999; where a photo does not tell the time,
    and within a second, as a counter counts."""
    folders = list(dict.fromkeys(PurePath(name).parent for name in taken_s))
    counted = sorted(taken_s, key=lambda name: (folders.index(PurePath(name).parent), _counter(name)))
    timed = {name: time for name in counted if (time := taken_s[name]) is not None}
    if len(timed) == len(counted):
        return sorted(counted, key=lambda name: timed[name])
    if list(timed.values()) != sorted(timed.values()):
        silent = next(name for name in counted if name not in timed)
        raise BadInput(
            silent,
            "does not say when it was taken, and the other photos were not taken in the order of their names",
            "Name the photos in the order in which they were taken, or as the plan does",
        )
    return counted


def _counter(name: str) -> tuple[list[str | int], str]:
    """IMG_9 comes before IMG_10."""
    parts = re.split(r"([0-9]+)", PurePath(name).name.casefold())
    return [int(part) if k % 2 else part for k, part in enumerate(parts)], name


def _in_time(log: FlightLog) -> list[Shot]:
    return sorted(log.shots, key=lambda shot: shot.time_s)
