"""The planned flight: where the vehicle goes, where it shoots, and the mission that says so in MAVLink."""

from typing import Literal

from schemas.camera import Camera, CameraPose
from schemas.contract import Contract, Vector3
from schemas.geodesy import GeoOrigin
from schemas.problem import LeftOut
from schemas.vehicle import Vehicle


class Waypoint(Contract):
    """A point of the path (paper, section 2.3). Shooting points carry the photo's name and surface."""

    kind: Literal["shooting", "intermediate"]
    position_m: Vector3  # world ENU
    yaw_deg: float  # clockwise from north
    pitch_deg: float = 0.0  # of the camera, up positive
    surface: str | None = None
    photo: str | None = None  # stem of the photo's file name, unique in the plan

    @property
    def pose(self) -> CameraPose:
        return CameraPose(position_m=self.position_m, yaw_deg=self.yaw_deg, pitch_deg=self.pitch_deg)


class SurfaceCoverage(Contract):
    """What the plan will see of one surface, by ray casting from the planned poses."""

    surface: str
    area_m2: float
    covered: float  # share of the area seen at the asked GSD and angle at least once
    stand_off_m: float
    gsd_mm_px: float
    photos: int
    not_reached: tuple[str, ...] = ()  # reasons, in words, for what is not covered


class FlightPlan(Contract):
    camera: Camera
    vehicle: Vehicle
    origin: GeoOrigin
    home_m: Vector3  # on the ground, where the vehicle takes off and lands
    waypoints: tuple[Waypoint, ...]  # from take-off to landing, home itself not among them
    coverage: tuple[SurfaceCoverage, ...]
    length_m: float
    duration_s: float
    overlap: float  # used along both axes, widened for the position error
    left_out: tuple[LeftOut, ...] = ()

    @property
    def shooting_points(self) -> tuple[Waypoint, ...]:
        return tuple(w for w in self.waypoints if w.kind == "shooting")
