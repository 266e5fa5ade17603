"""Shooting points against the geometry they promise."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from schemas.camera import CameraPose
from schemas.problem import BadInput
from schemas.settings import PlanSettings
from schemas.surface import Surface
from schemas.vehicle import Vehicle
from tasks.planning.airspace import Airspace
from tasks.planning.coverage import seen_by
from tasks.planning.sight import Scene, outline_of
from tasks.planning.viewpoints import Views, camera_towards, shooting_grid, shooting_points, widened_overlap
from tests.planning.structures import CAMERA, VEHICLE, World, box, rectangle, wall

SETTINGS = PlanSettings(gsd_mm_px=1.0, overlap=0.5)
ANYWHERE = Airspace(np.array([[0.0, 0.0, -500.0]]), 1.0, -1e6, 1e6)


def views_of(surface: Surface, world: World, vehicle: Vehicle = VEHICLE) -> Views:
    airspace = Airspace(world.cloud, vehicle.inflation_m, 0.5, 120.0)
    scene = Scene(world.surfaces, world.cloud)
    return shooting_points(surface, CAMERA, vehicle, 4.0, 0.5, SETTINGS, airspace, scene)


@settings(max_examples=40)
@given(
    *(st.floats(0.3, 9), st.floats(0.3, 9), st.floats(0.5, 3), st.floats(0.5, 3)),
    *(st.floats(0.1, 0.8), st.floats(0, 1.5)),
)
def test_photos_reach_beyond_the_outline_and_overlap(
    width: float, height: float, across: float, up: float, overlap: float, margin: float
) -> None:
    surface = rectangle("wall-01", (0.0, 0.0, 0.0), (0, -1, 0), width, height)
    places, targets = shooting_grid(surface, (across, up), overlap, margin)
    half = np.array([across, up]) / 2
    seen = shapely.union_all(shapely.box(*(targets - half - 1e-9).T, *(targets + half + 1e-9).T))
    wanted = shapely.box(-width / 2, -height / 2, width / 2, height / 2)
    assert shapely.contains(seen, wanted)
    low, high = targets.min(axis=0) - half, targets.max(axis=0) + half
    assert (low <= -np.array([width, height]) / 2 - margin + 1e-6).all()
    assert (high >= np.array([width, height]) / 2 + margin - 1e-6).all()
    for axis, size in ((1, across), (0, up)):
        lines = np.unique(np.round(targets[:, 1 - axis], 9))
        if len(lines) > 1:
            assert np.diff(lines).max() <= size * (1 - overlap) + 1e-6
    assert len(np.unique(places, axis=0)) == len(places)


def test_photos_that_miss_the_outline_are_left_out() -> None:
    ring = ((0.0, 0.0), (12.0, 0.0), (12.0, 2.0), (2.0, 2.0), (2.0, 12.0), (0.0, 12.0))
    surface = rectangle("wall-01", (0.0, 0.0, 0.0), (0, -1, 0), 1, 1).model_copy(update={"outline_m": ring})
    _, targets = shooting_grid(surface, (1.6, 1.2), 0.5, 0.1)
    half = np.array([0.8, 0.6])
    assert shapely.intersects(
        shapely.box(*(targets - half).T, *(targets + half).T), outline_of(surface)
    ).all()
    assert len(targets) < 0.5 * (12 / 0.8) * (12 / 0.6)


def test_too_many_photos_are_refused_with_their_number() -> None:
    surface = rectangle("deck-01", (0.0, 0.0, 0.0), (0, 0, 1), 100, 25)
    with pytest.raises(BadInput, match=r"deck-01.*photos"):
        shooting_grid(surface, (0.16, 0.12), 0.6, 0.2)


def test_overlap_is_widened_by_the_jitter_and_bounded() -> None:
    assert widened_overlap(0.5, (1.6, 1.2), 0.0) == 0.5
    assert widened_overlap(0.5, (1.6, 1.2), 0.03) == pytest.approx(0.5 + 2 * np.sqrt(2) * 0.03 / 1.2)
    assert widened_overlap(0.5, (1.6, 1.2), 0.5) == 0.8
    assert widened_overlap(0.9, (1.6, 1.2), 0.5) == 0.9


@settings(max_examples=60)
@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_the_camera_looks_where_it_is_told(x: float, y: float, z: float) -> None:
    forward = np.array([[x, y, z]])
    if np.linalg.norm(forward) < 0.1:
        return
    forward /= np.linalg.norm(forward)
    yaw, pitch, flown = camera_towards(forward, np.array([1.0, 0.0, 0.0]))
    pose = CameraPose(position_m=(0.0, 0.0, 0.0), yaw_deg=float(yaw[0]), pitch_deg=float(pitch[0]))
    assert pose.R_world_camera[:, 2] == pytest.approx(flown[0], abs=1e-9)
    assert np.degrees(np.arccos(np.clip(flown[0] @ forward[0], -1, 1))) < 5.01


@pytest.mark.parametrize(
    "normal", [(0, -1, 0), (1, 1, 0), (0, 0, -1), (0, 0, 1), (0.01, -0.02, -1), (-1, 2, 1)]
)
def test_photos_are_square_to_the_surface(normal: tuple[float, float, float]) -> None:
    surface = rectangle("s", (1.0, 2.0, 6.0), normal, 3.0, 2.0)
    scene = Scene([], np.empty((0, 3)))
    found = shooting_points(surface, CAMERA, VEHICLE, 4.0, 0.5, SETTINGS, ANYWHERE, scene)
    assert found.reached == 1.0
    for view in found.views:
        pose = view.pose
        right, down, forward = pose.R_world_camera.T
        tilt = np.degrees(np.arccos(np.clip(-forward @ surface.plane.normal, -1, 1)))
        assert tilt < 2.0
        assert abs(CAMERA.project(view.target_m, pose) - CAMERA.principal_px).max() < 0.5  # pixels
        assert surface.plane.signed_distance_m(pose.position_m) == pytest.approx(4.0, abs=0.01)
        if abs(surface.plane.normal[2]) > 0.99 or surface.plane.normal[2] == 0:
            assert right @ np.array(surface.u) > np.cos(np.radians(2))
            assert -down @ np.array(surface.v) > np.cos(np.radians(2))


def test_a_gimbal_that_cannot_look_up_sees_a_soffit_obliquely_or_not_at_all() -> None:
    world = wall()
    soffit = rectangle("soffit-01", (0.0, 0.0, 9.0), (0, 0, -1), 6.0, 2.0)
    oblique = views_of(soffit, world, VEHICLE.model_copy(update={"gimbal_pitch_max_deg": 60.0}))
    assert oblique.reached > 0.9
    assert all(v.pose.pitch_deg <= 60.0 for v in oblique.views)
    level = views_of(soffit, world, VEHICLE.model_copy(update={"gimbal_pitch_max_deg": 20.0}))
    assert not level.views
    assert "gimbal" in next(iter(level.refused))


def test_a_shooting_point_in_an_obstacle_moves_aside() -> None:
    """A mast of 0.2 m, 4 m off the wall, where the camera would be: the same targets are seen from beside."""
    plain, world = wall(), wall().add_points(box((-0.1, -4.1, 0.0), (0.1, -3.9, 9.0)))
    surface = world.surfaces[1]
    free, beside = views_of(surface, plain), views_of(surface, world)
    assert beside.reached == 1.0
    assert len(beside.views) == len(free.views)
    points = world.cloud
    for view in beside.views:
        position = np.array(view.pose.position_m)
        assert np.linalg.norm(points - position, axis=1).min() >= VEHICLE.inflation_m
        forward = view.pose.R_world_camera[:, 2]
        assert -forward @ surface.plane.normal >= np.cos(np.radians(SETTINGS.max_incidence_deg)) - 1e-9
    moved = [v for v in beside.views if v.pose not in {f.pose for f in free.views}]
    assert 0 < len(moved) < len(beside.views)


@pytest.mark.parametrize("yaw", [0.0, 20.0, 70.0])
def test_the_grid_of_a_soffit_lies_along_it_however_the_bridge_stands(yaw: float) -> None:
    angle = np.radians(yaw)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    straight = rectangle("soffit-01", (0.0, 0.0, 9.0), (0, 0, -1), 11.0, 1.2)
    ring = tuple((float(u), float(v)) for u, v in np.array(straight.outline_m) @ turn.T)
    soffit = straight.model_copy(update={"outline_m": ring, "hull_m": ring})
    scene = Scene([], np.empty((0, 3)))
    found = shooting_points(soffit, CAMERA, VEHICLE, 4.0, 0.5, SETTINGS, ANYWHERE, scene)
    assert found.reached == 1.0
    assert len(found.views) <= 36  # 18 along by 2 across; along v by u for the one that lies nearer to v
    seen = seen_by(soffit, CAMERA, [v.pose for v in found.views], 1.0, 45.0, scene)
    assert seen.covered >= 0.995
