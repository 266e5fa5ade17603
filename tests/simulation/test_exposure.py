import numpy as np
import pytest

from schemas.camera import CameraPose
from tasks.simulation.exposure import (
    BLUR_SIGMA_PX,
    FINE_SAMPLES,
    READOUT_S,
    SAMPLES,
    Motion,
    spread,
)
from tasks.simulation.marks import discs, line
from tests.simulation.laboratory import AHEAD, BOARD, CAMERA, GREY, photo_of

OBLIQUE = CameraPose(position_m=(0.22, -1.2, -0.13), yaw_deg=-11.0, pitch_deg=6.0, roll_deg=5.0)
NO_LENS = CAMERA.model_copy(update={"k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0})


def darkness(photo: np.ndarray) -> np.ndarray:
    return 1.0 - photo.astype(float) / GREY


def profile(photo: np.ndarray) -> np.ndarray:
    """Darkness along the image's middle rows, averaged: for upright slits."""
    return darkness(photo)[80:100].mean(axis=0)


def test_at_least_eight_samples_a_pixel() -> None:
    assert min(SAMPLES, FINE_SAMPLES) >= 8


@pytest.mark.parametrize("count", [SAMPLES, FINE_SAMPLES])
def test_samples_spread_as_photosite_and_blur(count: int) -> None:
    """Mean 0, variance σ² + 1/12 on each axis: a photosite's box and the lens's Gaussian."""
    points = spread(count)
    assert points.mean(axis=0) == pytest.approx([0, 0, 0], abs=0.03)
    assert points[:, :2].var(axis=0) == pytest.approx([BLUR_SIGMA_PX**2 + 1 / 12] * 2, rel=1e-6)
    assert points[:, 2].min() >= -0.5 and points[:, 2].max() <= 0.5


@pytest.mark.parametrize("pose", [AHEAD, OBLIQUE])
def test_dots_appear_where_the_camera_model_projects_them(pose: CameraPose) -> None:
    u, v = np.meshgrid(np.linspace(0.43, 0.57, 4), np.linspace(0.35, 0.45, 3))
    uv = np.column_stack([u.ravel(), v.ravel()])
    photo = darkness(photo_of([discs(uv, np.full(len(uv), 0.004), np.zeros(len(uv)))], pose))
    for x, y in CAMERA.project(BOARD.to_world(uv), pose):
        x0, y0 = round(x), round(y)
        window = photo[y0 - 9 : y0 + 10, x0 - 9 : x0 + 10]
        rows, columns = np.mgrid[y0 - 9 : y0 + 10, x0 - 9 : x0 + 10]
        centre = (columns * window).sum() / window.sum(), (rows * window).sum() / window.sum()
        assert np.hypot(centre[0] - x, centre[1] - y) < 0.06  # px


@pytest.mark.parametrize("width_mm", [0.3, 1.0, 2.5, 6.0])
@pytest.mark.parametrize("slant_m", [0.013, 0.07])
def test_a_slit_integrates_to_its_width(width_mm: float, slant_m: float) -> None:
    slit = line((0.5 - slant_m, 0.25), (0.5 + slant_m, 0.55), width_mm / 1e3, 0.0)
    across = profile(photo_of([slit], camera=NO_LENS)).sum() * np.cos(np.arctan(2 * slant_m / 0.3))
    assert across == pytest.approx(width_mm, rel=0.01, abs=0.01)  # px of 1 mm


def test_the_darkness_inside_a_wide_slit_is_its_own() -> None:
    photo = photo_of([line((0.5, 0.2), (0.5, 0.6), 0.02, 0.35)])
    assert photo[85:95, 118:122].mean() == pytest.approx(0.35 * GREY, rel=0.005)


def test_a_thin_slit_is_blurred_as_the_lens_says() -> None:
    dark = profile(photo_of([line((0.49, 0.2), (0.51, 0.6), 0.0004, 0.0)], camera=NO_LENS))
    rows = darkness(photo_of([line((0.49, 0.2), (0.51, 0.6), 0.0004, 0.0)], camera=NO_LENS))[80:100]
    assert dark.sum() == pytest.approx(0.4, abs=0.02)
    x = np.arange(rows.shape[1])
    centre = (rows * x).sum(axis=1) / rows.sum(axis=1)
    variance = np.mean([(r * (x - c) ** 2).sum() / r.sum() for r, c in zip(rows, centre, strict=True)])
    assert variance == pytest.approx(BLUR_SIGMA_PX**2 + 1 / 12, rel=0.12)


def test_the_board_ends_where_it_ends() -> None:
    """Area of the board in the picture, against the sky, to a thousandth."""
    pose = CameraPose(position_m=(0.0, -6.0, 0.0), yaw_deg=0.3, pitch_deg=0.2, roll_deg=2.0)
    photo = photo_of([], pose).astype(float)
    sky = photo[2, 2]
    seen = ((photo - sky) / (GREY - sky)).sum()
    x, y = CAMERA.project(BOARD.corners_m, pose).T
    area = abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) / 2
    assert seen == pytest.approx(area, rel=1e-3)


def test_motion_smears_along_it() -> None:
    """1 m/s across for 4 ms at 1 mm/px: 4 px. Its second moment grows by 4²/12, and across nothing grows."""
    camera = NO_LENS.model_copy(update={"shutter_s": 0.004})
    dot = [discs(np.array([[0.5, 0.4]]), np.array([0.003]), np.zeros(1))]
    moving = darkness(photo_of(dot, motion=Motion(np.array([1.0, 0, 0]), np.zeros(3)), camera=camera))
    still = darkness(photo_of(dot, camera=camera))
    y, x = np.mgrid[: still.shape[0], : still.shape[1]]

    def spread_px2(photo: np.ndarray, axis: np.ndarray) -> float:
        mean = (photo * axis).sum() / photo.sum()
        return float((photo * (axis - mean) ** 2).sum() / photo.sum())

    assert spread_px2(moving, x) - spread_px2(still, x) == pytest.approx(16 / 12, rel=0.1)
    assert spread_px2(moving, y) - spread_px2(still, y) == pytest.approx(0.0, abs=0.1)


def test_rows_are_exposed_one_after_the_other() -> None:
    """1 m/s to the right: the picture of an upright line leans by the readout's share of the way."""
    slit = [line((0.5, 0.2), (0.5, 0.6), 0.003, 0.0)]
    photo = darkness(photo_of(slit, motion=Motion(np.array([1.0, 0.0, 0.0]), np.zeros(3)), camera=NO_LENS))
    x = np.arange(photo.shape[1])
    centre = (photo * x).sum(axis=1) / photo.sum(axis=1)
    lean = np.polyfit(np.arange(len(centre)), centre, 1)[0] * len(centre)
    assert lean == pytest.approx(-READOUT_S * 1000.0, rel=0.05)  # px of 1 mm
