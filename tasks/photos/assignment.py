"""Which photo of a folder is which shot of a flight log."""

from collections.abc import Sequence
from pathlib import PurePath

from schemas.assigned_shot import AssignedShot
from schemas.flight_log import FlightLog, Shot
from schemas.problem import BadInput


def assign_shots(names: Sequence[str], log: FlightLog) -> tuple[AssignedShot, ...]:
    """Match photo file names to the log's shots: by the planned photo's name where the files carry it,
    else in order (cameras count upwards), which needs as many photos as shots.

    names: (N,) file names. Raises BadInput where neither fits, since a shifted match puts every crack
    in a wrong place.
    """
    by_name = {shot.photo: shot for shot in log.shots}
    named = tuple(
        AssignedShot(name=name, shot=by_name[PurePath(name).stem])
        for name in names
        if PurePath(name).stem in by_name
    )
    if named:
        return named
    if len(names) == len(log.shots):
        return tuple(
            AssignedShot(name=name, shot=shot)
            for name, shot in zip(sorted(names), _in_time(log), strict=True)
        )
    raise BadInput(
        "photos",
        f"the folder holds {len(names)} photos but the flight log has {len(log.shots)} shots",
        "Take out photos that were not shot by the mission, or name them as the plan does",
    )


def _in_time(log: FlightLog) -> list[Shot]:
    return sorted(log.shots, key=lambda shot: shot.time_s)
