"""The lens models: against OpenCV's, and undone to a millionth of a pixel."""

import cv2
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pydantic import ValidationError

from schemas.camera import Camera, CameraPose
from schemas.distortion import Brown, Distortion, Fisheye
from schemas.inspection import CameraInput

FOCAL_PX = 2000.0
GRID = np.stack(np.meshgrid(np.linspace(-0.8, 0.8, 9), np.linspace(-0.6, 0.6, 7)), axis=-1).reshape(-1, 2)
small = st.floats(-0.02, 0.02)


def brown(width: float, k1: float, k2: float, p1: float, p2: float, k3: float) -> Camera:
    """Half a photo's diagonal is `width` focal lengths; coefficients are shares of the radius at its edge."""
    r2 = width * width
    return Camera(
        width_px=3200, height_px=2400, focal_px=2000.0 / width,
        k1=k1 / r2, k2=k2 / r2**2, k3=k3 / r2**3, p1=p1 / width, p2=p2 / width,
    )  # fmt: skip


@given(st.floats(0.1, 1.0), st.floats(-0.25, 0.25), st.floats(-0.05, 0.05), small, small, small)
def test_a_brown_lens_is_undone(width: float, k1: float, k2: float, p1: float, p2: float, k3: float) -> None:
    r2 = np.linspace(0, 1, 20) ** 2
    assume((1 + r2 * (3 * k1 + r2 * (5 * k2 + r2 * 7 * k3)) > 0.35).all())  # p1, p2 may take 0.2 of it
    camera = brown(width, k1, k2, p1, p2, k3)
    ideal = width * GRID
    off = camera.undistort(camera.distort(ideal)) - ideal
    assert np.abs(off).max() * camera.focal_px <= 1e-6


@given(st.floats(0.3, 1.25), st.floats(-0.1, 0.1), st.floats(-0.03, 0.03), small, small)
def test_a_fisheye_is_undone(half_field_rad: float, k1: float, k2: float, k3: float, k4: float) -> None:
    camera = Camera(
        width_px=3200, height_px=2400, focal_px=2000.0 / half_field_rad, lens="fisheye", k1=k1, k2=k2,
        k3=k3, k4=k4,
    )  # fmt: skip
    pose = CameraPose(position_m=(1.0, 2.0, 3.0), yaw_deg=20.0, pitch_deg=-30.0, roll_deg=5.0)
    theta = np.linspace(0.0, 0.95 * half_field_rad, 12)
    slope = 1 + 3 * k1 * theta**2 + 5 * k2 * theta**4 + 7 * k3 * theta**6 + 9 * k4 * theta**8
    assume((slope > 0.1).all())
    angle = np.linspace(0, 6, 12)
    rays = np.column_stack([np.sin(theta) * np.cos(angle), np.sin(theta) * np.sin(angle), np.cos(theta)])
    points = 4.0 * rays @ pose.R_world_camera.T + pose.position_m
    px = camera.project(points, pose)
    assert (
        np.abs(camera.project(camera.back_project(px, pose) * 7.0 + pose.position_m, pose) - px).max() < 1e-6
    )


def test_the_models_are_opencvs() -> None:
    space = np.column_stack([GRID, np.ones(len(GRID))])[:, None]
    K = np.array([[FOCAL_PX, 0, 1000.0], [0, FOCAL_PX, 700.0], [0, 0, 1]])
    k1, k2, p1, p2, k3, k4 = -0.21, 0.08, 0.002, -0.001, -0.013, 0.004
    zero = np.zeros(3)
    theirs, _ = cv2.projectPoints(space, zero, zero, K, np.array([k1, k2, p1, p2, k3]))
    ours = Camera(width_px=2001, height_px=1401, focal_px=FOCAL_PX, k1=k1, k2=k2, p1=p1, p2=p2, k3=k3)
    assert np.abs(ours.distort(GRID) * FOCAL_PX + ours.principal_px - theirs[:, 0]).max() < 1e-9
    theirs, _ = cv2.fisheye.projectPoints(space, zero, zero, K, np.array([k1, k2, k3, k4]))
    fish = Camera(
        width_px=2001, height_px=1401, focal_px=FOCAL_PX, lens="fisheye", k1=k1, k2=k2, k3=k3, k4=k4
    )
    assert np.abs(fish.distort(GRID) * FOCAL_PX + fish.principal_px - theirs[:, 0]).max() < 1e-9


@pytest.mark.parametrize(
    "lens", [Brown(-0.2, 0.1, 0.003, -0.002, 0.05), Fisheye(-0.03, 0.01, -0.005, 0.001)], ids=str
)
def test_slopes_are_those_of_finite_differences(lens: Distortion) -> None:
    step = 1e-6
    for xy in (GRID, 1e-5 * GRID):
        for axis in range(2):
            move = step * np.eye(2)[axis]
            by_difference = (lens.distort(xy + move) - lens.distort(xy - move)) / (2 * step)
            np.testing.assert_allclose(lens.slope(xy)[:, :, axis], by_difference, atol=2e-9)
    bent = type(lens)(*[value + (step if n == 0 else 0.0) for n, value in enumerate(vars(lens).values())])
    np.testing.assert_allclose(lens.by_k1(GRID), (bent.distort(GRID) - lens.distort(GRID)) / step, atol=1e-9)


def test_where_no_ray_leads_there_is_no_answer() -> None:
    barrel = Camera(width_px=3200, height_px=2400, focal_px=2000.0, k1=-0.5)  # folds at r = 0.82
    assert np.isnan(barrel.undistort([[0.9, 0.0]])).all()
    assert np.isfinite(barrel.undistort([[0.5, 0.0]])).all()
    fish = Camera(width_px=3200, height_px=2400, focal_px=2000.0, lens="fisheye")
    assert np.isnan(fish.undistort([[1.6, 0.0]])).all()  # 92° off the axis
    np.testing.assert_allclose(fish.undistort([[1.0, 0.0], [0.0, 0.0]]), [[np.tan(1.0), 0.0], [0.0, 0.0]])


def test_coefficients_of_the_other_lens_are_refused() -> None:
    size = {"width_px": 100, "height_px": 80, "focal_px": 90.0}
    for wrong in ({"lens": "fisheye", "p1": 0.1}, {"k4": 0.1}, {"lens": "telescope"}):
        for contract in (Camera, CameraInput):
            with pytest.raises(ValidationError, match="fisheye"):
                contract.model_validate(size | wrong)
    assert CameraInput.model_validate(size | {"lens": "fisheye", "k4": 0.1}).camera().k4 == 0.1


def test_an_ideal_lens_says_so() -> None:
    assert Camera(width_px=100, height_px=80, focal_px=90.0).is_ideal
    assert not Camera(width_px=100, height_px=80, focal_px=90.0, lens="fisheye").is_ideal


@pytest.mark.parametrize(
    "focal", [{"focal_px": 1e9}, {"focal_px": 3.0}, {"focal_mm": 8.8, "sensor_width_mm": 0.0132}]
)
def test_a_focal_length_in_other_units_is_told(focal: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="from left to right: focal_px and width_px are pixels"):
        CameraInput.model_validate({"width_px": 4000, "height_px": 3000} | focal)
