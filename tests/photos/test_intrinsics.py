"""The camera of a turned or resized photo sees what the original saw."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.camera import Camera
from schemas.problem import BadInput
from tasks.photos.intrinsics import camera_of_photo

CAMERA = Camera(
    width_px=1632, height_px=1224, focal_px=2000.0, cx_px=830.0, cy_px=600.0, k1=-0.08, p1=0.002, p2=-0.001
)
# Ideal image coordinates in the upright photo from those of the stored one, by EXIF orientation.
TURN = {
    1: np.eye(2),
    3: -np.eye(2),
    6: np.array([[0.0, -1.0], [1.0, 0.0]]),
    8: np.array([[0.0, 1.0], [-1.0, 0.0]]),
}


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
@given(x=st.floats(-0.3, 0.3), y=st.floats(-0.2, 0.2))
def test_a_turned_photo_has_a_turned_camera(orientation: int, x: float, y: float) -> None:
    size = (1632, 1224) if orientation in (1, 3) else (1224, 1632)
    turned = camera_of_photo(CAMERA, *size, orientation, "photo")
    stored_px = (CAMERA.distort([[x, y]]) * CAMERA.focal_px + CAMERA.principal_px)[0]
    upright_px = {
        1: stored_px,
        3: np.array([1631.0, 1223.0]) - stored_px,
        6: np.array([1223.0 - stored_px[1], stored_px[0]]),
        8: np.array([stored_px[1], 1631.0 - stored_px[0]]),
    }[orientation]
    ideal = TURN[orientation] @ [x, y]
    seen = (turned.distort([ideal]) * turned.focal_px + turned.principal_px)[0]
    np.testing.assert_allclose(seen, upright_px, atol=1e-9)


def test_a_photo_of_half_the_size_has_half_the_focal_length() -> None:
    half = camera_of_photo(CAMERA, 816, 612, 1, "photo")
    assert half.focal_px == 1000.0
    assert half.principal_px == pytest.approx((414.75, 299.75))  # (830 + ½) / 2 − ½


def test_a_photo_of_another_shape_is_refused() -> None:
    with pytest.raises(BadInput, match="1000 × 1000 px, the camera 1632 × 1224 px"):
        camera_of_photo(CAMERA, 1000, 1000, 1, "photo.jpg")
