"""Crack width, ground sample distance, stand-off and effort side by side, before anything is scanned."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from schemas.camera import Camera
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.flights import MOST_SHOTS
from tasks.planning.request import planned_stand_off_m
from tasks.planning.sight import outline_of
from tasks.planning.timing import shooting_s, travel_s
from tasks.planning.viewpoints import widened_overlap

CRACKS_MM = (0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0)
BLUR_PX = 0.5  # that motion may add
THERE_AND_BACK_S = 60.0  # of each flight: take-off, way to the surface, way back, landing


@dataclass(frozen=True)
class Effort:
    """What photographing an area takes, about."""

    photos: int
    hours: float  # of flight
    batteries: int


@dataclass(frozen=True)
class Case:
    """One ground sample distance with this camera and vehicle."""

    gsd_mm_px: float
    detects_mm: float  # cracks of one pixel
    measures_mm: float  # cracks of three
    farthest_m: float  # where a pixel is as large as asked
    planned_m: float  # less the position error; NaN where that cannot be flown
    photos_per_m2: float
    depth_of_field_m: float | None  # either side
    sharp_to_m_s: float  # speed at which the shutter blurs half a pixel, and
    sharp_to_deg_s: float  # turning rate of gimbal or nose
    refused: str = ""  # why it cannot be flown

    def effort(self, area_m2: float, vehicle: Vehicle, camera: Camera) -> Effort:
        """Photos, hours of flight and batteries for an area."""
        photos = math.ceil(area_m2 * self.photos_per_m2)
        step_m = 1.0 / math.sqrt(self.photos_per_m2)
        each_s = float(travel_s(step_m, vehicle)) + shooting_s(0.0, 0.0, vehicle, camera)
        usable_s = max(vehicle.endurance_s * (1 - vehicle.reserve) - THERE_AND_BACK_S, each_s)
        flights = max(math.ceil(photos * each_s / usable_s), math.ceil(photos / MOST_SHOTS))
        return Effort(photos, (photos * each_s + flights * THERE_AND_BACK_S) / 3600.0, flights)


def case(gsd_mm_px: float, camera: Camera, vehicle: Vehicle, overlap: float) -> Case:
    """The counts are those of a plane without borders, at the overlap that the position error widens."""
    refused = ""
    try:
        planned = planned_stand_off_m(gsd_mm_px, camera, vehicle)
    except BadInput as problem:
        planned, refused = math.nan, str(problem)
    stands = planned if not refused else camera.stand_off_m(gsd_mm_px)
    width, height = camera.footprint_m(stands)
    widened = widened_overlap(overlap, (width, height), vehicle.position_jitter_m)
    return Case(
        gsd_mm_px=gsd_mm_px,
        detects_mm=gsd_mm_px,
        measures_mm=3 * gsd_mm_px,
        farthest_m=camera.stand_off_m(gsd_mm_px),
        planned_m=planned,
        photos_per_m2=1.0 / (width * height * (1 - widened) ** 2),
        depth_of_field_m=camera.depth_of_field_m(stands),
        sharp_to_m_s=BLUR_PX * gsd_mm_px / 1000 / camera.shutter_s,
        sharp_to_deg_s=math.degrees(BLUR_PX / camera.focal_px / camera.shutter_s),
        refused=refused,
    )


def cases(camera: Camera, vehicle: Vehicle, overlap: float) -> list[Case]:
    """For each of some crack widths the ground sample distances that detect and measure it, finest first."""
    sizes = sorted({round(width / px, 4) for width in CRACKS_MM for px in (1, 3)})
    return [case(size, camera, vehicle, overlap) for size in sizes]


def case_at(stand_off_m: float, camera: Camera, vehicle: Vehicle, overlap: float) -> Case:
    """The other way round: what is seen from a stand-off, wherever the position error takes the vehicle."""
    return case(camera.gsd_mm_px(stand_off_m + vehicle.position_error_m), camera, vehicle, overlap)


def effort_of(
    surfaces: Sequence[Surface], camera: Camera, vehicle: Vehicle, settings: PlanSettings
) -> Effort:
    """What a plan of these surfaces will take, about, told before it is made."""
    stands = case(settings.asked_gsd_mm_px, camera, vehicle, settings.overlap)
    area = sum(outline_of(s).buffer(vehicle.sideways_error_m, join_style="mitre").area for s in surfaces)
    return stands.effort(area, vehicle, camera)
