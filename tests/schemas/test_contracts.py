"""Contracts are values: equal by content, copied with what was changed, whatever was asked of them before."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from schemas.camera import Camera, CameraPose
from schemas.plane import Plane
from schemas.problem import BadInput
from schemas.surface import Surface, in_plane_axes

CAMERA = Camera(width_px=1632, height_px=1224, focal_px=4000, k1=-0.03, p1=0.001)
angles = st.floats(-180, 180)


def test_equality_and_copies_do_not_depend_on_what_was_asked_before() -> None:
    assert CAMERA.K[0, 2] == 815.5
    assert CAMERA.model_copy() == CAMERA
    assert CAMERA.model_copy(update={"cx_px": 800.0}).K[0, 2] == 800.0


def test_gsd_stand_off_and_footprint_agree() -> None:
    assert CAMERA.gsd_mm_px(4.0) == 1.0
    assert CAMERA.stand_off_m(1.0) == 4.0
    assert CAMERA.footprint_m(4.0) == pytest.approx((1.632, 1.224))


@given(yaw=angles, pitch=st.floats(-90, 90), roll=angles)
def test_a_pose_is_a_rotation_and_back_projection_undoes_projection(
    yaw: float, pitch: float, roll: float
) -> None:
    pose = CameraPose(position_m=(1, 2, 3), yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
    R = pose.R_world_camera
    assert np.allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)
    pixels = np.array([[0.0, 0.0], [815.0, 611.0], [1631.0, 40.0]])
    points = CAMERA.back_project(pixels, pose) * 4.0 + pose.position_m
    assert np.allclose(CAMERA.project(points, pose), pixels, atol=1e-3)


def test_yaw_turns_clockwise_from_north_and_pitch_up() -> None:
    east = CameraPose(position_m=(0, 0, 0), yaw_deg=90, pitch_deg=0).R_world_camera
    assert np.allclose(east[:, 2], (1, 0, 0))  # looks east
    assert np.allclose(east[:, 1], (0, 0, -1))  # its down is down
    up = CameraPose(position_m=(0, 0, 0), yaw_deg=0, pitch_deg=90).R_world_camera
    assert np.allclose(up[:, 2], (0, 0, 1))


@given(
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).filter(
        lambda n: np.hypot(*n[:2]) + abs(n[2]) > 0.1
    )
)
def test_a_surfaces_frame_is_right_handed_and_undone_by_its_inverse(
    normal: tuple[float, float, float],
) -> None:
    plane = Plane.through((1, 2, 3), normal)
    u, v = in_plane_axes(plane.normal)
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    surface = Surface(
        name="s", plane=plane, origin_m=(1, 2, 3), u=u, v=v, outline_m=square, hull_m=square, area_m2=1.0
    )
    assert np.allclose(np.cross(u, v), plane.normal, atol=1e-9)
    uvw = np.array([[0.3, -2.0, 0.7]])
    assert np.allclose(surface.to_surface(surface.to_world(uvw)), uvw, atol=1e-9)
    assert plane.signed_distance_m(surface.to_world(uvw)) == pytest.approx([0.7], abs=1e-9)


def test_contracts_refuse_unknown_keys_nan_and_changes() -> None:
    with pytest.raises(ValidationError):
        CameraPose(position_m=(0, 0, 0), yaw_deg=float("nan"), pitch_deg=0)
    with pytest.raises(ValidationError):
        Camera(width_px=1, height_px=1, focal_px=1, zoom=2)  # type: ignore[call-arg]
    with pytest.raises(ValidationError):
        CAMERA.focal_px = 1.0  # type: ignore[misc]
    with pytest.raises(ValidationError):
        Plane(normal=(1, 1, 0), d_m=0)


def test_a_problem_names_the_item_and_says_what_to_do() -> None:
    assert str(BadInput("a.ply", "is empty", "Export it again")) == "a.ply: is empty. Export it again"
