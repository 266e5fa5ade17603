"""Where a photo's XMP says that the camera looked, in the angles of CameraPose."""

import math
import re

import numpy as np

from schemas.camera import CameraPose
from schemas.contract import Vector3

# XMP "Camera:Yaw, Pitch, Roll" are Pix4D's, 0 looking down; other makers write 0 for level under these names.
PIX4D_MAKERS = ("sensefly", "micasense", "parrot")


def stated_view_deg(xmp: bytes, make: str) -> Vector3 | None:
    """Yaw, pitch, roll. make: EXIF's. None where nothing is said, or what it means depends on the writer."""
    for names in ("Gimbal{}Degree", r"drone-parrot:Camera{}Degree"):  # DJI, Parrot: level is 0, down −90
        yaw, pitch, roll = (xmp_number(xmp, names.format(axis)) for axis in ("Yaw", "Pitch", "Roll"))
        if yaw is not None and pitch is not None:
            return _level_is_0(yaw, pitch, roll or 0.0)
    maker = make.strip("\x00 ").lower()
    yaw, pitch, roll = (xmp_number(xmp, f"Camera:{axis}") for axis in ("Yaw", "Pitch", "Roll"))
    if yaw is None or pitch is None or not maker.startswith(PIX4D_MAKERS):
        return None
    return _down_is_0(yaw, pitch, -(roll or 0.0) if maker.startswith("sensefly") else roll or 0.0)


def xmp_number(xmp: bytes, name: str) -> float | None:
    """Of an attribute or an element of this name."""
    found = re.search(name.encode() + rb"\s*(?:=\s*\"|>)\s*([+-]?[0-9.]+)", xmp)
    try:
        return float(found.group(1)) if found else None
    except ValueError:
        return None


def _level_is_0(yaw: float, pitch: float, roll: float) -> Vector3 | None:
    if abs(pitch) > 135 or abs(yaw) > 360 or abs(roll) > 360:
        return None
    if abs(roll) > 90:  # DJI writes a gimbal looking down past −90° as rolled by 180°
        return yaw + 180.0, -180.0 - pitch if pitch < 0 else 180.0 - pitch, roll - math.copysign(180.0, roll)
    return yaw, pitch, roll


def _down_is_0(yaw: float, pitch: float, roll: float) -> Vector3 | None:
    """Pix4D turns an aircraft about down, right wing and nose; its camera looks down, its top ahead."""
    if abs(pitch) > 180 or abs(yaw) > 360 or abs(roll) > 360:
        return None
    (sy, sp, sr), (cy, cp, cr) = (
        np.sin(np.radians([yaw, pitch, roll])),
        np.cos(np.radians([yaw, pitch, roll])),
    )
    right = np.array([sy * sp * sr + cy * cr, cy * sp * sr - sy * cr, -cp * sr])  # east, north, up
    ahead = np.array([sy * sp * cr - cy * sr, cy * sp * cr + sy * sr, -cp * cr])
    yaw_deg = float(np.degrees(np.arctan2(ahead[0], ahead[1])))
    pitch_deg = float(np.degrees(np.arcsin(np.clip(ahead[2], -1.0, 1.0))))
    unrolled = CameraPose(position_m=(0.0, 0.0, 0.0), yaw_deg=yaw_deg, pitch_deg=pitch_deg).R_world_camera
    across, down, _ = unrolled.T @ right
    return yaw_deg, pitch_deg, float(np.degrees(np.arctan2(down, across)))
