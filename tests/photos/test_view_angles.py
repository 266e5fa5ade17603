"""Where drones of several makers say that their cameras looked."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from schemas.camera import CameraPose
from tasks.photos.view_angles import stated_view_deg

PARROT = b"""<drone-parrot:CameraRollDegree>-0.32</drone-parrot:CameraRollDegree>
 <drone-parrot:CameraPitchDegree>-78.36</drone-parrot:CameraPitchDegree>
 <drone-parrot:CameraYawDegree>176.31</drone-parrot:CameraYawDegree>"""


def pix4d(yaw: float, pitch: float, roll: float) -> bytes:
    return f'<rdf:Description Camera:Yaw="{yaw}" Camera:Pitch="{pitch}" Camera:Roll="{roll}"/>'.encode()


def seen_from(view_deg: tuple[float, float, float] | None) -> np.ndarray:
    """(3, 3) R_world_camera."""
    assert view_deg is not None
    yaw, pitch, roll = view_deg
    pose = CameraPose(position_m=(0, 0, 0), yaw_deg=yaw, pitch_deg=pitch, roll_deg=roll)
    return pose.R_world_camera


def test_parrots_camera_looks_down_at_minus_90() -> None:
    assert stated_view_deg(PARROT, "Parrot") == (176.31, -78.36, -0.32)
    both = PARROT + pix4d(0.0, 11.64, 0.0)
    assert stated_view_deg(both, "Parrot") == (176.31, -78.36, -0.32)


@pytest.mark.parametrize(
    ("said", "right", "ahead"),
    [
        ((0.0, 0.0, 0.0), (1, 0, 0), (0, 0, -1)),  # down, the image's top to the north
        ((90.0, 0.0, 0.0), (0, -1, 0), (0, 0, -1)),  # its top to the east
        ((0.0, 90.0, 0.0), (1, 0, 0), (0, 1, 0)),  # at a wall in the north
        ((180.0, 90.0, 0.0), (-1, 0, 0), (0, -1, 0)),
        ((0.0, 0.0, 90.0), (0, 0, -1), (-1, 0, 0)),  # the right wing down: to the west
    ],
)
def test_pix4ds_camera_looks_down_at_0(
    said: tuple[float, float, float], right: tuple[float, ...], ahead: tuple[float, ...]
) -> None:
    R = seen_from(stated_view_deg(pix4d(*said), "MicaSense"))
    np.testing.assert_allclose(R[:, 0], right, atol=1e-9)
    np.testing.assert_allclose(R[:, 2], ahead, atol=1e-9)


@pytest.mark.parametrize("said", [(30.0, 5.0, -4.0), (200.0, -3.0, 2.0), (-75.0, 60.0, 10.0)])
def test_pix4ds_angles_turn_an_aircraft(said: tuple[float, float, float]) -> None:
    """Its nose, right wing and belly from north, east and down; the camera's x, y, z lie along right wing,
    tail and belly. senseFly counts its roll the other way."""
    body = Rotation.from_euler("ZYX", said, degrees=True).as_matrix()
    camera = np.column_stack([body[:, 1], -body[:, 0], body[:, 2]])
    wanted = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]]) @ camera
    np.testing.assert_allclose(seen_from(stated_view_deg(pix4d(*said), "Parrot")), wanted, atol=1e-9)
    yaw, pitch, roll = said
    np.testing.assert_allclose(
        seen_from(stated_view_deg(pix4d(yaw, pitch, -roll), "senseFly\x00")), wanted, atol=1e-9
    )


@pytest.mark.parametrize("make", ["", "Autel Robotics", "Skydio"])
def test_angles_that_mean_one_thing_or_another_are_not_taken(make: str) -> None:
    assert stated_view_deg(pix4d(0.0, 0.0, 0.0), make) is None
