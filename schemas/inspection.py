"""The inspection file that a user writes (YAML). Paths are relative to the file's own folder."""

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from schemas.camera import Camera, check_lens
from schemas.contract import Contract, Matrix4, Vector3
from schemas.control import Control
from schemas.geodesy import GeoOrigin, KnownPoint
from schemas.gsd import GsdMmPx
from schemas.scanning import Scanning
from schemas.settings import (
    AssessSettings,
    DetectSettings,
    PatternSettings,
    PlanSettings,
    RegistrationSettings,
    ReportSettings,
    StitchSettings,
    SurfaceSettings,
)
from schemas.target import SiteTarget
from schemas.utm import UtmZone
from schemas.vehicle import Vehicle

NARROWEST_DEG, WIDEST_DEG = 0.5, 170.0  # that a lens sees from left to right, at least and at most


class CameraInput(Contract):
    """A camera by its lens or by its calibrated focal length; give one of the two."""

    width_px: int = Field(gt=0)
    height_px: int = Field(gt=0)
    focal_px: float | None = Field(default=None, gt=0)
    focal_mm: float | None = Field(default=None, gt=0)
    sensor_width_mm: float | None = Field(default=None, gt=0)
    cx_px: float | None = None
    cy_px: float | None = None
    lens: Literal["brown", "fisheye"] = "brown"
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    shutter_s: float = Field(default=1 / 1000, gt=0)
    max_rate_hz: float = Field(default=1.0, gt=0)
    f_number: float | None = Field(default=None, gt=0)
    pixel_um: float | None = Field(default=None, gt=0)  # None: from sensor_width_mm, where given
    autofocus: bool = True

    @model_validator(mode="after")
    def _one_focal_length(self) -> Self:
        by_lens = self.focal_mm is not None and self.sensor_width_mm is not None
        if by_lens == (self.focal_px is not None):
            raise ValueError("give either focal_px, or focal_mm together with sensor_width_mm")
        check_lens(self.lens, self.p1, self.p2, self.k4)
        view_deg = math.degrees(2 * math.atan(self.width_px / 2 / self._focal_px))
        if not NARROWEST_DEG <= view_deg <= WIDEST_DEG:
            raise ValueError(
                f"it would see {view_deg:.2g}° from left to right: focal_px and width_px are pixels,"
                " focal_mm and sensor_width_mm millimetres"
            )
        return self

    @property
    def _focal_px(self) -> float:
        return self.focal_px or (self.focal_mm or 0.0) / (self.sensor_width_mm or 1.0) * self.width_px

    def camera(self) -> Camera:
        focal_px = self._focal_px
        known = self.model_dump(exclude={"focal_px", "focal_mm", "sensor_width_mm"})
        if self.pixel_um is None and self.sensor_width_mm is not None:
            known["pixel_um"] = self.sensor_width_mm / self.width_px * 1000.0
        return Camera(focal_px=focal_px, **known)


class ScanInput(Contract):
    file: str
    unit: Literal["m", "mm", "cm", "ft", "in"] = "m"
    position_m: Vector3 | None = None  # of the scanner, in the world
    T_world_scan: Matrix4 | None = None
    targets: dict[str, Vector3] = Field(default_factory=dict)  # name: centre, in the file's unit


class PhotoSet(Contract):
    """A folder of photos of one surface (or of all planned surfaces, when they come from a flight)."""

    folder: str
    surface: str | None = None  # None: by the flight log's shots, else the folder's name
    stitch: bool = True  # False: each photo stands for itself
    gsd_mm_px: GsdMmPx | None = None
    stand_off_m: float | None = Field(default=None, gt=0)  # with a camera, the other way to say the GSD


class SimulationInput(Contract):
    scene: Literal["bridge", "wall", "arch", "facade"]
    seed: int = 1
    scanner: Scanning = Scanning()


class Inspection(Contract):
    name: str = Field(pattern=r"^[^\W_][\w.-]*$")  # also the folder's name under runs/, in any alphabet
    simulation: SimulationInput | None = None  # a rehearsal: scans, vehicle and photos are simulated
    scans: tuple[ScanInput, ...] = ()
    targets: tuple[
        SiteTarget, ...
    ] = ()  # surveyed: control ties the model to the site, check points judge it
    flight: Literal["simulated", "vehicle", "external"] | None = None  # None: no flight
    connection: str | None = None  # of `flight: vehicle`
    mission: str = "1"  # a new id flies again
    flight_log: str | tuple[str, ...] | None = None  # of an external flight; a list: a log a battery
    photos: tuple[PhotoSet, ...] = ()
    control: dict[str, Control] = Field(default_factory=dict)  # of mosaics, by the name of their surface
    camera: CameraInput | None = None
    vehicle: Vehicle = Vehicle()
    origin: GeoOrigin | None = None
    utm_zone: UtmZone | None = None  # of scans or targets in UTM, where no file states it; instead of origin
    anchors: tuple[KnownPoint, ...] = ()  # instead: points {model_m, latitude_deg, longitude_deg, altitude_m}
    home_m: Vector3 | None = None  # None: a free place beside the structure
    registration: RegistrationSettings = RegistrationSettings()
    surfaces: SurfaceSettings = SurfaceSettings()
    plan: PlanSettings = PlanSettings()
    stitch: StitchSettings = StitchSettings()
    patterns: PatternSettings = PatternSettings()
    detect: DetectSettings = DetectSettings()
    assess: AssessSettings = AssessSettings()
    report: ReportSettings = ReportSettings()
