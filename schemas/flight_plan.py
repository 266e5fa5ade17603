"""The planned flight: where the vehicle goes, where it shoots, and the mission that says so in MAVLink."""

from typing import Literal

from schemas.box import Box
from schemas.camera import Camera, CameraPose
from schemas.contract import Contract, Vector2, Vector3
from schemas.file import File
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
    reachable: float = 1.0  # share that allowed places show at that GSD and angle, wherever the position errs
    twice: float | None = None  # share of the reachable area in at least two photos, flown exactly as planned
    twice_median: float | None = None  # and over many flights whose positions err as the vehicle's do:
    twice_p05: float | None = None  # 95 of 100 flights show more than this
    measurable_mm: float | None = None  # crack width that can be measured on 95 % of the reachable area
    width_map: File | None = None  # TIFF, float32 mm: smallest measurable width, NaN where nothing is seen


class Flight(Contract):
    """One battery's part of a plan: from home through some of its waypoints and back home."""

    first: int  # number of its first waypoint in the plan, from 0
    last: int  # of its last
    photos: int
    length_m: float
    duration_s: float  # from take-off to landing
    battery: float  # share of the vehicle's endurance


class FlightPlan(Contract):
    camera: Camera
    vehicle: Vehicle
    origin: GeoOrigin
    home_m: Vector3  # on the ground, where the vehicle takes off and lands
    waypoints: tuple[Waypoint, ...]  # from take-off to landing, flight by flight, home itself not among them
    coverage: tuple[SurfaceCoverage, ...]
    length_m: float
    duration_s: float
    overlap: float  # used along both axes, widened for the position error
    fence_m: tuple[Vector2, ...] | None = None  # corners [e, n] that the flights stay inside of
    no_fly_m: tuple[Box, ...] = ()  # that they stay outside of
    flights: tuple[Flight, ...] = ()  # in order; none: a plan of one flight
    return_height_m: float | None = None  # RTL_ALT: a failsafe's way home is known air; None: at no height
    left_out: tuple[LeftOut, ...] = ()

    @property
    def each_flight(self) -> "tuple[FlightPlan, ...]":
        """The plan's flights as plans of one flight each, all of them from and to the same home."""
        if len(self.flights) < 2:
            return (self,)
        return tuple(
            self.model_copy(
                update={
                    "waypoints": self.waypoints[flight.first : flight.last + 1],
                    "flights": (),
                    "length_m": flight.length_m,
                    "duration_s": flight.duration_s,
                }
            )
            for flight in self.flights
        )

    @property
    def way_home(self) -> str:
        """What a failsafe may do, in words."""
        if self.return_height_m is None:
            return (
                "No height is known at which a failsafe can come straight home: let it land, or fly back the"
                " way it came (SmartRTL)"
            )
        return (
            f"A failsafe comes home through known air with RTL_ALT at {self.return_height_m:g} m"
            f" ({100 * self.return_height_m:.0f} cm): `hairline fly` sets it, else set it before take-off"
        )

    @property
    def shooting_points(self) -> tuple[Waypoint, ...]:
        return tuple(w for w in self.waypoints if w.kind == "shooting")
