"""Every setting of every stage, its default explained on its line."""

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from schemas.box import Box
from schemas.contract import Contract, Vector2
from schemas.gsd import GsdMmPx


class RegistrationSettings(Contract):
    voxel_m: float = Field(default=0.02, gt=0)  # merged model's point spacing; fine for planes of a bridge
    tau_m: float = Field(default=0.10, gt=0)  # paper's τ: points closer than this overlap
    min_overlap: float = Field(default=0.10, gt=0, le=1)  # below this two scans are not tied to each other
    require_all: bool = False  # a scan that ties to no other ends the run; false: the others go on without it
    seed: int = 0


class SurfaceSettings(Contract):
    noise_filter: bool = True  # paper: remove sparse outliers
    voxel_m: float | None = Field(default=0.05, gt=0)  # paper: equal density; None switches it off
    clustering: bool = True  # paper: trim isolated groups
    distance_m: float = Field(default=0.02, gt=0)  # RANSAC inlier distance, ~5σ of a terrestrial scanner
    min_area_m2: float = Field(default=0.5, gt=0)  # smaller patches are no surface to inspect
    epsilon_m: float = Field(default=0.5, gt=0)  # paper's ε: obstacles are more than this apart
    seed: int = 0


class PlanSettings(Contract):
    smallest_crack_mm: float = Field(default=0.3, gt=0)  # to be detected; its width is one GSD
    smallest_measured_mm: float | None = Field(default=None, gt=0)  # to be measured; three GSD wide
    gsd_mm_px: GsdMmPx | None = None  # None: from the smallest cracks
    overlap: float = Field(default=0.6, ge=0.1, lt=0.95)  # between neighbours, both axes, before widening
    max_incidence_deg: float = Field(default=45.0, gt=0, lt=80)  # more oblique views are not counted
    voxel_m: float = Field(default=0.25, gt=0)  # occupancy grid
    a1: float = Field(default=1.0, gt=0)  # paper's weights of a step east-west,
    a2: float = Field(default=1.0, gt=0)  # north-south
    a3: float = Field(default=1.0, gt=0)  # and up-down
    surfaces: tuple[str, ...] | None = None  # names to inspect; None: all but the ground
    min_altitude_m: float = Field(default=0.5, ge=0)  # above the ground, scanned or inferred from around it
    max_altitude_m: float = Field(default=120.0, gt=0)  # above the ground
    water_m: float | None = None  # level of a river or the sea, which scanners do not see
    scanner_reach_m: float = Field(default=40.0, gt=0)  # without an echo, free air is taken for known to here
    free_m: tuple[
        Box, ...
    ] = ()  # {low_m: [e, n, u], high_m: […]}: no scanner saw it, the crew vouches for it
    no_fly_m: tuple[Box, ...] = ()  # boxes never to enter, as free_m
    fence_m: tuple[Vector2, ...] | None = Field(default=None, min_length=3)  # corners [e, n] never to leave

    @property
    def asked_gsd_mm_px(self) -> float:
        """Ground sample distance of the request: to detect a crack takes its width, to measure it a third."""
        if self.gsd_mm_px is not None:
            return self.gsd_mm_px
        return min(self.smallest_crack_mm, (self.smallest_measured_mm or math.inf) / 3)


class FlightSettings(Contract):
    connection: str | None = None  # "udpin:127.0.0.1:14550", "tcp:…", "/dev/ttyUSB0"; None: simulated vehicle
    timeout_s: float = Field(default=30.0, gt=0)  # without a heartbeat for this long the vehicle is lost


class StitchSettings(Contract):
    features: int = Field(default=4000, ge=100)  # most SIFT features of a photo
    gsd_mm_px: GsdMmPx | None = None  # states the scale; None: from poses or GPS
    ransac_px: float = Field(default=3.0, gt=0)  # inlier distance of the homography
    min_sharpness: float | None = None  # None: photos far below their neighbours are rejected as blurred


class PatternSettings(Contract):
    remove: bool = True  # off where no markers were stuck on and the surface is colourful
    margin_px: int = Field(default=3, ge=0)  # grown around each marker


class DetectSettings(Contract):
    method: Literal["hairline", "ridge", "paper", "global", "onnx"] = "hairline"
    model: str | None = None  # of `onnx`: the network's file, beside the inspection file
    min_score: float = Field(
        default=0.5, ge=0, le=1
    )  # least probability that what a network found is a crack
    window_px: int | None = Field(default=None, ge=3)  # paper's N; cracks up to N/2 wide; None: 63
    k: float = Field(default=0.5, gt=0, lt=1)  # paper; `ridge` lowers it where the surface is smooth
    R: float = Field(default=128.0, gt=0)  # paper
    global_threshold: int | None = Field(default=None, ge=1, le=254)  # of `global`; None: from the peaks
    baselines: bool = False  # also the global thresholds 125, 155 and the peaks' own, for the report
    min_length_mm: float = Field(default=50.0, gt=0)  # shorter things are no cracks where a scale is known
    min_length_px: float = Field(default=30.0, gt=0)  # and where none is

    def least_px(self, gsd_mm_px: float | None, side_px: int) -> float:
        """Least length of a crack in an image whose shorter side is `side_px`: where that shows less in all,
        from near, half of it."""
        least_px = self.min_length_px if gsd_mm_px is None else self.min_length_mm / gsd_mm_px
        return min(least_px, side_px / 2)

    @model_validator(mode="after")
    def _a_model_for_onnx_alone(self) -> Self:
        if (self.method == "onnx") != (self.model is not None):
            raise ValueError("the method onnx needs a model, and no other method takes one")
        return self


class AssessSettings(Contract):
    """Severity by width. The limits are those of common bridge manuals; set your own authority's."""

    fine_mm: float = Field(default=0.2, gt=0)  # below: hairline
    medium_mm: float = Field(default=0.5, gt=0)  # below: fine
    wide_mm: float = Field(default=1.0, gt=0)  # below: medium; from here: wide

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.fine_mm <= self.medium_mm <= self.wide_mm:
            raise ValueError("fine_mm, medium_mm and wide_mm must not descend")
        return self


class ReportSettings(Contract):
    close_up_mm: float = Field(default=300.0, gt=0)  # side of the picture around each crack
    baselines: bool = False  # the paper's panels side by side
