"""The camera of a photo: the one the user gave, turned and scaled to the photo, or the one EXIF tells."""

import math

from schemas.camera import Camera
from schemas.problem import BadInput
from tasks.photos.metadata import Metadata

_FULL_FRAME_DIAGONAL_MM = math.hypot(36.0, 24.0)
# Quarter turns (clockwise) that make a photo upright, by EXIF orientation (2, 4, 5, 7 mirror as well).
QUARTER_TURNS = {3: 2, 5: 1, 6: 1, 7: 1, 8: 3}


def camera_of_photo(camera: Camera, width_px: int, height_px: int, orientation: int, name: str) -> Camera:
    """The given camera for an upright photo of this size. A photo resized as a whole scales it.

    Raises BadInput where the photo has another shape than the camera: it comes from another camera."""
    turned = camera
    for _ in range(QUARTER_TURNS.get(orientation, 0)):
        turned = _turn(turned)
    if (turned.width_px > turned.height_px) != (width_px > height_px) and orientation == 1:
        turned = _turn(turned)  # stored upright by other software, its orientation forgotten
    scale = width_px / turned.width_px
    if abs(turned.height_px * scale - height_px) > 1.0:
        raise BadInput(
            name,
            f"is {width_px} × {height_px} px, the camera {camera.width_px} × {camera.height_px} px",
            "Give the camera that took this photo, or none to read it from the photo",
        )
    if scale == 1.0:
        return turned
    cx, cy = turned.principal_px
    return _changed(
        turned,
        width_px=width_px,
        height_px=height_px,
        focal_px=turned.focal_px * scale,
        cx_px=(cx + 0.5) * scale - 0.5,
        cy_px=(cy + 0.5) * scale - 0.5,
    )


def _turn(camera: Camera) -> Camera:
    """The camera of the image turned clockwise by 90°: (x, y) → (height − 1 − y, x)."""
    cx, cy = camera.principal_px
    return _changed(
        camera,
        width_px=camera.height_px,
        height_px=camera.width_px,
        cx_px=camera.height_px - 1 - cy,
        cy_px=cx,
        p1=camera.p2,  # (p2, p1) turns as a vector does
        p2=-camera.p1,
    )


def _changed(camera: Camera, **values: float) -> Camera:
    """Not model_copy: it would carry over the cached matrix."""
    return Camera.model_validate(camera.model_dump() | values)


def camera_from_metadata(width_px: int, height_px: int, metadata: Metadata) -> tuple[Camera, str, float]:
    """Camera without distortion, what its focal length rests on, and its relative 1σ.

    In order: DJI's calibration, focal length with the sensor's resolution, the 35-mm equivalent (by the
    diagonal, CIPA DCG-001; images wider than 3:2 are taken for crops of a 4:3 sensor), else a guess."""
    longer = max(width_px, height_px)
    resized = _resized(width_px, height_px, metadata)
    calibrated_px = (metadata.calibrated_focal_px or 0.0) * resized
    by_sensor_px = (metadata.focal_mm or 0.0) * (metadata.px_per_mm or 0.0) * resized
    focal_px, source, sigma = (
        1.2 * longer,
        "assumed: no focal length in the photo, 1.2 × its longer side",
        0.3,
    )
    if 0.2 < calibrated_px / longer < 50:
        focal_px, source, sigma = calibrated_px, "XMP calibrated focal length", 0.02
    elif 0.2 < by_sensor_px / longer < 50:
        focal_px, source, sigma = by_sensor_px, "EXIF focal length and sensor", 0.03
    elif metadata.focal_35mm:
        aspect = longer / min(width_px, height_px)
        diagonal = math.hypot(1.0, 0.75) if aspect > 1.55 else math.hypot(1.0, 1.0 / aspect)
        focal_px = metadata.focal_35mm / _FULL_FRAME_DIAGONAL_MM * diagonal * longer
        source, sigma = "EXIF 35-mm equivalent focal length, no distortion assumed", 0.05
    return Camera(width_px=width_px, height_px=height_px, focal_px=focal_px), source, sigma


def _resized(width_px: int, height_px: int, metadata: Metadata) -> float:
    """How many pixels of the photo one of the camera's became, by the size that EXIF states: software that
    shrinks a photo often leaves EXIF as it was. 1 for a photo of another shape: it was cut, or EXIF errs."""
    if metadata.size_px is None:
        return 1.0
    (shorter, longer), (own_shorter, own_longer) = sorted(metadata.size_px), sorted((width_px, height_px))
    scale = own_longer / longer
    return scale if abs(shorter * scale - own_shorter) <= 1.0 else 1.0
