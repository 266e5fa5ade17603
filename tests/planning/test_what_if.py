"""Effort and sight before any scan, against counts and equations worked out by hand."""

import math

import numpy as np
import pytest

from schemas.camera import Camera
from schemas.crack import Crack
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.vehicle import Vehicle
from tasks.planning.close_ups import BESIDE_M, close_ups
from tasks.planning.plan import plan_and_prove
from tasks.planning.request import planned_stand_off_m
from tasks.planning.sight import outline_of
from tasks.planning.what_if import case, case_at, cases
from tests.planning.structures import CAMERA, OPEN, ORIGIN, VEHICLE, wall

TWELVE_MP = Camera(width_px=4000, height_px=3000, focal_px=20_000.0)
EXACT = Vehicle(position_bias_m=0.0, position_jitter_m=0.0)
FIFTY_MM = Camera(width_px=8192, height_px=5460, focal_px=50e3 / 4.4, f_number=5.6, pixel_um=4.4)


def test_a_deck_takes_as_many_photos_as_its_area_says() -> None:
    for gsd, photos in ((0.3, 14_468), (0.1, 130_209)):
        takes = case(gsd, TWELVE_MP, EXACT, 0.6).effort(2500.0, EXACT, TWELVE_MP)
        assert takes.photos == photos
        assert takes.hours * 3600 > photos * EXACT.hold_s
        least = takes.hours * 3600 / (EXACT.endurance_s * (1 - EXACT.reserve))
        assert least <= takes.batteries
        assert takes.batteries * 214 >= photos  # shots that ArduPilot's 650 mission items hold
        assert takes.batteries <= max(1.2 * least, photos / 214) + 1


def test_the_table_goes_both_ways() -> None:
    for one in cases(CAMERA, VEHICLE, 0.6):
        assert one.measures_mm == pytest.approx(3 * one.detects_mm)
        assert CAMERA.gsd_mm_px(one.farthest_m) == pytest.approx(one.gsd_mm_px)
        if not one.refused:
            back = case_at(one.planned_m, CAMERA, VEHICLE, 0.6)
            assert back.gsd_mm_px == pytest.approx(one.gsd_mm_px)
    refused = [one.gsd_mm_px for one in cases(CAMERA, VEHICLE, 0.6) if one.refused]
    flown = [one.gsd_mm_px for one in cases(CAMERA, VEHICLE, 0.6) if not one.refused]
    assert refused and flown and max(refused) < min(flown)


def test_motion_blur_bounds_speed_and_rate() -> None:
    one = case(1.0, CAMERA, VEHICLE, 0.6)
    assert one.sharp_to_m_s == pytest.approx(0.5)  # half a pixel of 1 mm in a thousandth of a second
    assert math.radians(one.sharp_to_deg_s) * CAMERA.focal_px * CAMERA.shutter_s == pytest.approx(0.5)


def test_depth_of_field_of_a_50_mm_lens_at_a_tenth_of_a_millimetre() -> None:
    depth = FIFTY_MM.depth_of_field_m(FIFTY_MM.stand_off_m(0.1))
    assert depth == pytest.approx(0.013, abs=0.0005)
    assert CAMERA.depth_of_field_m(4.0) is None


def test_a_camera_focused_once_is_refused_where_the_vehicle_strays_out_of_focus() -> None:
    near = Vehicle(radius_m=0.2, clearance_m=0.3, position_bias_m=0.05, position_jitter_m=0.02)
    assert planned_stand_off_m(0.15, FIFTY_MM, near) > 0
    with pytest.raises(BadInput, match="focus") as problem:
        planned_stand_off_m(0.15, FIFTY_MM.model_copy(update={"autofocus": False}), near)
    enough = float(problem.value.remedy.split("f/")[1].split()[0])
    stopped = FIFTY_MM.model_copy(update={"autofocus": False, "f_number": enough})
    assert planned_stand_off_m(0.15, stopped, near) > 0


def a_crack(surface: str, points_m: tuple[tuple[float, float, float], ...]) -> Crack:
    return Crack(
        id=f"{surface}-C001", surface=surface, polyline_px=((0, 0), (9, 9)), length_px=9, width_median_px=2,
        width_max_px=3, orientation_deg=45, polyline_world_m=points_m,
    )  # fmt: skip


def test_a_second_pass_flies_along_the_cracks_alone() -> None:
    world = wall()
    crack = a_crack("wall-01", ((-1.0, 0.0, 4.0), (0.0, 0.0, 4.5), (1.0, 0.0, 5.5)))
    (strip,) = close_ups(world.structure.surfaces, [crack])
    length = math.dist((-1, 4), (0, 4.5)) + math.dist((0, 4.5), (1, 5.5))
    assert outline_of(strip).area == pytest.approx((length + 2 * BESIDE_M) * 2 * BESIDE_M, rel=0.05)
    settings = PlanSettings(gsd_mm_px=0.8, free_m=(OPEN,))
    made, _ = plan_and_prove(
        world.structure, world.cloud, CAMERA, VEHICLE, ORIGIN, None, settings, cracks=(crack,)
    )
    assert [c.surface for c in made.coverage] == ["wall-01-C001"]
    assert made.coverage[0].twice == 1.0
    seen = [CAMERA.project([(0.0, 0.0, 4.5)], w.pose)[0] for w in made.shooting_points]
    inside = [np.all((px >= 0) & (px < (CAMERA.width_px, CAMERA.height_px))) for px in seen]
    assert sum(inside) >= 2
    assert len(made.shooting_points) < 40  # the wall takes 130


def test_cracks_of_another_structure_are_refused() -> None:
    with pytest.raises(BadInput, match="none of the 1 cracks"):
        close_ups(wall().structure.surfaces, [a_crack("deck-07", ((0, 0, 0), (1, 0, 0)))])
