"""The flown flight: its archive, its track and its shots."""

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
    missed: tuple[str, ...] = ()  # planned photos that the log has no shot of
