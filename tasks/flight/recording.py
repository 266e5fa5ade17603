"""What a flight log of any kind comes down to: fixes of the vehicle and triggers of its camera."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from schemas.contract import Vector3

TRACK_S = 0.095  # closer fixes are thinned out: the track keeps about 10 Hz


@dataclass(frozen=True)
class Fix:
    time_s: float  # of the vehicle's clock
    latitude_deg: float
    longitude_deg: float
    altitude_m: float  # above mean sea level
    height_m: float  # above home
    yaw_deg: float  # clockwise from north, 0..360


@dataclass(frozen=True)
class Trigger:
    """One exposure as the vehicle reported it."""

    fix: Fix
    pitch_deg: float  # of the vehicle or the gimbal, as the log says
    index: int | None  # the vehicle's count of exposures, where it tells


@dataclass
class Recording:
    vehicle: str = "unknown vehicle"
    fixes: list[Fix] = field(default_factory=list)
    triggers: list[Trigger] = field(default_factory=list)
    armed_s: list[tuple[float, float]] = field(default_factory=list)  # when the motors ran
    said: list[tuple[float, str]] = field(default_factory=list)  # when the vehicle warned, and of what

    def add(self, fix: Fix) -> bool:
        """Keep a fix unless it is closer than TRACK_S to the last one; says whether it was kept."""
        if self.fixes and 0 <= fix.time_s - self.fixes[-1].time_s < TRACK_S:
            return False
        self.fixes.append(fix)
        return True


class Recorder(Protocol):
    """Where a flight is archived while it happens (artifacts.flight_log.FlightArchive)."""

    def frame(self, time_ns: int, raw: bytes) -> None: ...

    def original(self, time_ns: int, block: bytes) -> None: ...

    def location(
        self, time_ns: int, latitude_deg: float, longitude_deg: float, altitude_m: float, of: str = ""
    ) -> None: ...

    def pose(
        self, time_ns: int, position_m: Vector3, yaw_deg: float, pitch_deg: float = 0.0, of: str = ""
    ) -> None: ...


def archive(
    recorder: Recorder,
    time_ns: int,
    read: Fix | Trigger | None,
    world_pose: Callable[[Fix], tuple[Vector3, float]],
) -> None:
    """Write what viewers draw: the vehicle's or, at a trigger, the camera's location and pose."""
    if read is None:
        return
    fix = read.fix if isinstance(read, Trigger) else read
    of, pitch = ("/camera", read.pitch_deg) if isinstance(read, Trigger) else ("", 0.0)
    recorder.location(time_ns, fix.latitude_deg, fix.longitude_deg, fix.altitude_m, of=of)
    recorder.pose(time_ns, *world_pose(fix), pitch, of=of)
