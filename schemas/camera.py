"""The camera: a pinhole behind a lens, and the pose it takes a photo from."""

from typing import Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from schemas.contract import Contract, Vector3
from schemas.distortion import Brown, Distortion, Fisheye

Array = npt.NDArray[np.float64]


class CameraPose(Contract):
    """Where a camera stands and looks. World is ENU (x east, y north, z up), metres.

    yaw_deg: clockwise from north, as a compass; pitch_deg: up is positive, −90 looks straight down,
    +90 straight up; roll_deg: clockwise about the view axis. At ±90° pitch, yaw still turns the image:
    looking straight down its top points along yaw, looking straight up against it.
    """

    position_m: Vector3
    yaw_deg: float
    pitch_deg: float
    roll_deg: float = 0.0

    @property
    def R_world_camera(self) -> Array:
        """(3, 3): columns are the camera's axes in the world: x right, y down, z forward."""
        yaw, pitch, roll = np.radians([self.yaw_deg, self.pitch_deg, self.roll_deg])
        right = np.array([np.cos(yaw), -np.sin(yaw), 0.0])
        forward = np.array([np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
        down = np.cross(forward, right)
        turned_right = np.cos(roll) * right + np.sin(roll) * down
        turned_down = -np.sin(roll) * right + np.cos(roll) * down
        return np.column_stack([turned_right, turned_down, forward])


class Camera(Contract):
    """Intrinsics. A pixel's centre is at integer coordinates; (0, 0) is the centre of the first pixel."""

    width_px: PositiveInt
    height_px: PositiveInt
    focal_px: PositiveFloat
    cx_px: float | None = None  # principal point; None: the image's centre
    cy_px: float | None = None
    lens: Literal["brown", "fisheye"] = "brown"  # which model the coefficients belong to (schemas/distortion)
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0  # of brown alone
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0  # of fisheye alone
    shutter_s: float = Field(default=1 / 1000, gt=0)  # exposure time, bounds the speed by motion blur
    max_rate_hz: float = Field(default=1.0, gt=0)  # photos a second that it can store
    f_number: float | None = Field(default=None, gt=0)  # aperture, with pixel_um: what is in focus
    pixel_um: float | None = Field(default=None, gt=0)  # side of a pixel on the sensor
    autofocus: bool = True  # False: focused once, at the planned stand-off

    @classmethod
    def from_lens(cls, width_px: int, height_px: int, focal_mm: float, sensor_width_mm: float) -> "Camera":
        return cls(width_px=width_px, height_px=height_px, focal_px=focal_mm / sensor_width_mm * width_px)

    @property
    def principal_px(self) -> tuple[float, float]:
        return (
            (self.width_px - 1) / 2 if self.cx_px is None else self.cx_px,
            (self.height_px - 1) / 2 if self.cy_px is None else self.cy_px,
        )

    @property
    def K(self) -> Array:
        cx, cy = self.principal_px
        return np.array([[self.focal_px, 0.0, cx], [0.0, self.focal_px, cy], [0.0, 0.0, 1.0]])

    @model_validator(mode="after")
    def _coefficients_of_its_lens(self) -> Self:
        check_lens(self.lens, self.p1, self.p2, self.k4)
        return self

    @property
    def distortion(self) -> Distortion:
        if self.lens == "fisheye":
            return Fisheye(self.k1, self.k2, self.k3, self.k4)
        return Brown(self.k1, self.k2, self.p1, self.p2, self.k3)

    @property
    def is_ideal(self) -> bool:
        """Photos need no undistortion."""
        return self.lens == "brown" and not any((self.k1, self.k2, self.p1, self.p2, self.k3))

    def gsd_mm_px(self, distance_m: float) -> float:
        """Ground sample distance of a surface seen perpendicularly from `distance_m`."""
        return distance_m * 1000.0 / self.focal_px

    def stand_off_m(self, gsd_mm_px: float) -> float:
        """The distance at which a pixel covers `gsd_mm_px`."""
        return gsd_mm_px * self.focal_px / 1000.0

    def depth_of_field_m(self, distance_m: float) -> float | None:
        """How far before or behind a focused distance a point blurs over one pixel; None where the aperture
        is not stated. s²·N·c / f², the circle of confusion c being one pixel."""
        if self.f_number is None or self.pixel_um is None:
            return None
        return distance_m**2 * self.f_number / (self.focal_px**2 * self.pixel_um * 1e-6)

    def footprint_m(self, distance_m: float) -> tuple[float, float]:
        """Width and height of what a photo covers of a perpendicular surface."""
        gsd_m = self.gsd_mm_px(distance_m) / 1000.0
        return self.width_px * gsd_m, self.height_px * gsd_m

    def distort(self, xy: npt.ArrayLike) -> Array:
        """(N, 2) distorted from (N, 2) ideal normalised image coordinates."""
        return self.distortion.distort(np.asarray(xy, dtype=float))

    def undistort(self, xy: npt.ArrayLike) -> Array:
        """(N, 2) ideal normalised coordinates of (N, 2) distorted ones; NaN where the lens sends no ray."""
        return self.distortion.undistort(np.asarray(xy, dtype=float))

    def project(self, points_m: npt.ArrayLike, pose: CameraPose) -> Array:
        """(N, 2) pixels of (N, 3) world points; NaN for those behind the camera."""
        in_camera = (np.atleast_2d(np.asarray(points_m, dtype=float)) - pose.position_m) @ pose.R_world_camera
        z = np.where(in_camera[:, 2] > 1e-9, in_camera[:, 2], np.nan)
        return np.asarray(self.distort(in_camera[:, :2] / z[:, None]) * self.focal_px + self.principal_px)

    def back_project(self, pixels: npt.ArrayLike, pose: CameraPose) -> Array:
        """(N, 3) unit view rays in the world of (N, 2) pixels."""
        px = np.atleast_2d(np.asarray(pixels, dtype=float))
        xy = self.undistort((px - self.principal_px) / self.focal_px)
        rays = np.column_stack([xy, np.ones(len(xy))]) @ pose.R_world_camera.T
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def check_lens(lens: str, p1: float, p2: float, k4: float) -> None:
    """Raises ValueError where coefficients belong to the other lens."""
    if lens == "fisheye" and (p1 or p2):
        raise ValueError("p1 and p2 belong to lens brown, a fisheye has k1 to k4")
    if lens == "brown" and k4:
        raise ValueError("k4 belongs to lens fisheye, brown has k1 to k3, p1 and p2")
