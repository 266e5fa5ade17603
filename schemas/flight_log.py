"""The flown flight: its archive, its track and its shots."""

from collections.abc import Sequence

from schemas.camera import CameraPose
from schemas.contract import Contract, Vector3
from schemas.file import File


class TrackPoint(Contract):
    time_s: float  # since arming
    position_m: Vector3  # world ENU, as the vehicle estimated it
    yaw_deg: float


class Shot(Contract):
    """One camera trigger, as the vehicle reported it."""

    photo: str  # name of the planned photo, or "shot-0001" where the log knows no plan
    surface: str | None
    time_s: float
    pose: CameraPose
    velocity_m_s: Vector3 | None = None  # world ENU, from the track
    reported: bool = True  # False: the trigger's message was lost, pose interpolated from the track


class TrackError(Contract):
    """Planned against flown (paper, section 4.1), metres."""

    what: str  # "leg 12", or a surface's name, or "flight"
    rms_m: float
    largest_m: float


class FlightLog(Contract):
    archive: File  # MCAP: raw MAVLink frames, and pose, location, shots for people and viewers
    vehicle: str  # "simulated" or what the autopilot says of itself
    duration_s: float
    track: tuple[TrackPoint, ...]
    shots: tuple[Shot, ...]
    errors: tuple[TrackError, ...]
    said: tuple[str, ...] = ()  # what the vehicle warned of in flight, each once
    way_home: tuple[str, ...] = ()  # what was set for a failsafe's way home, and what is to be known of it
    missed: tuple[str, ...] = ()  # planned photos that the log has no shot of
    later_archives: tuple[File, ...] = ()  # of the plan's second and further flights


def joined(logs: Sequence[FlightLog]) -> FlightLog:
    """The flights of one plan as one log, in their order; times go on from flight to flight. A photo that two
    flights took is the first one's, unless only the other reported it; what any took is not missed."""
    if len(logs) == 1:
        return logs[0]
    starts_s = [sum(log.duration_s for log in logs[:k]) for k in range(len(logs))]
    shots: dict[str, Shot] = {}
    for start, log in zip(starts_s, logs, strict=True):
        for shot in log.shots:
            if shot.photo not in shots or (shot.reported and not shots[shot.photo].reported):
                shots[shot.photo] = shot.model_copy(update={"time_s": round(start + shot.time_s, 3)})
    files = [file for log in logs for file in (log.archive, *log.later_archives)]
    archives = tuple({file.sha256: file for file in files}.values())
    return FlightLog(
        archive=archives[0],
        vehicle=logs[0].vehicle,
        duration_s=round(sum(log.duration_s for log in logs), 3),
        track=tuple(
            point.model_copy(update={"time_s": round(start + point.time_s, 3)})
            for start, log in zip(starts_s, logs, strict=True)
            for point in log.track
        ),
        shots=tuple(sorted(shots.values(), key=lambda shot: shot.time_s)),
        errors=tuple(
            error.model_copy(update={"what": f"flight {number}: {error.what}"})
            for number, log in enumerate(logs, start=1)
            for error in log.errors
        ),
        said=tuple(dict.fromkeys(text for log in logs for text in log.said)),
        way_home=tuple(dict.fromkeys(text for log in logs for text in log.way_home)),
        missed=tuple(dict.fromkeys(photo for log in logs for photo in log.missed if photo not in shots)),
        later_archives=archives[1:],
    )
