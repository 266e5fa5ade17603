"""What a photo says of its camera and its place: EXIF, and XMP of drones."""

import math
import re
from dataclasses import dataclass
from datetime import datetime

from PIL import Image

from schemas.contract import Vector2, Vector3
from tasks.photos.view_angles import stated_view_deg, xmp_number

_MAKE, _EXIF_IFD, _GPS_IFD = 0x010F, 0x8769, 0x8825
_EXPOSURE_S, _ISO, _F_NUMBER = 0x829A, 0x8827, 0x829D
_TAKEN, _TAKEN_FRACTION = 0x9003, 0x9291  # DateTimeOriginal, SubSecTimeOriginal
_FOCAL_MM, _FOCAL_35MM, _PLANE_X_RESOLUTION, _PLANE_UNIT = 0x920A, 0xA405, 0xA20E, 0xA210
_WIDTH, _HEIGHT = 0xA002, 0xA003  # PixelXDimension, PixelYDimension
_MM_PER_UNIT = {2: 25.4, 3: 10.0, 4: 1.0}


@dataclass(frozen=True)
class Metadata:
    focal_mm: float | None
    focal_35mm: float | None  # 35-mm equivalent
    px_per_mm: float | None  # on the sensor, of the image as stored
    calibrated_focal_px: float | None  # DJI's own calibration
    gps: Vector3 | None  # latitude, longitude (degrees), altitude above take-off (m; 0: not known)
    view_deg: Vector3 | None  # yaw, pitch, roll of the camera, as in CameraPose
    velocity_m_s: Vector3 | None = None  # east, north, up
    metered_ev: float | None = None  # log2 of exposure time (s) · ISO / 100 / f-number²
    size_px: Vector2 | None = None  # width and height that px_per_mm and calibrated_focal_px are of


def read_metadata(exif: Image.Exif, xmp: bytes) -> Metadata:
    """Never raises: what is absent, garbled or out of range is None."""
    camera = _ifd(exif, _EXIF_IFD)
    unit = _MM_PER_UNIT.get(int(_number(camera.get(_PLANE_UNIT)) or 2))
    resolution = _positive(camera.get(_PLANE_X_RESOLUTION))
    return Metadata(
        focal_mm=_positive(camera.get(_FOCAL_MM)),
        focal_35mm=_positive(camera.get(_FOCAL_35MM)),
        px_per_mm=resolution / unit if resolution and unit else None,
        calibrated_focal_px=_positive(xmp_number(xmp, "CalibratedFocalLength")),
        gps=_gps(_ifd(exif, _GPS_IFD), xmp_number(xmp, "RelativeAltitude")),
        view_deg=stated_view_deg(xmp, str(exif.get(_MAKE, ""))),
        velocity_m_s=_velocity(xmp),
        metered_ev=_metered_ev(camera),
        size_px=_size_px(camera),
    )


def _size_px(camera: dict[int, object]) -> Vector2 | None:
    width, height = _positive(camera.get(_WIDTH)), _positive(camera.get(_HEIGHT))
    return None if width is None or height is None else (width, height)


def taken_s(exif: Image.Exif) -> float | None:
    """Seconds since 1970 by the camera's own clock, whatever its time zone; None where it is not stated."""
    camera = _ifd(exif, _EXIF_IFD)
    try:
        taken = datetime.strptime(str(camera.get(_TAKEN)).strip("\x00 "), "%Y:%m:%d %H:%M:%S")
    except ValueError:
        return None
    fraction = re.match(r"\d+", str(camera.get(_TAKEN_FRACTION)))
    return (taken - datetime(1970, 1, 1)).total_seconds() + (float(f"0.{fraction[0]}") if fraction else 0.0)


def _metered_ev(camera: dict[int, object]) -> float | None:
    """None where any of the three is missing: a factor of unknown size would be worse than none."""
    iso = camera.get(_ISO)
    seconds, f_number = _positive(camera.get(_EXPOSURE_S)), _positive(camera.get(_F_NUMBER))
    speed = _positive(iso[0] if isinstance(iso, tuple) and iso else iso)
    if seconds is None or speed is None or f_number is None:
        return None
    return math.log2(seconds * speed / 100.0 / f_number**2)


def _velocity(xmp: bytes) -> Vector3 | None:
    """DJI writes it along north, east and down."""
    north, east, down = (xmp_number(xmp, f"Flight{axis}Speed") for axis in "XYZ")
    return None if north is None or east is None or down is None else (east, north, -down)


def _ifd(exif: Image.Exif, tag: int) -> dict[int, object]:
    try:
        return dict(exif.get_ifd(tag))
    except Exception:  # Pillow raises whatever a garbled block leads it into
        return {}


def _number(value: object) -> float | None:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) else None


def _positive(value: object) -> float | None:
    number = _number(value)
    return number if number is not None and number > 0 else None


def _gps(block: dict[int, object], relative_altitude_m: float | None) -> Vector3 | None:
    latitude = _degrees(block.get(2), block.get(1), "S", 90.0)
    longitude = _degrees(block.get(4), block.get(3), "W", 180.0)
    if latitude is None or longitude is None or (latitude == 0.0 and longitude == 0.0):
        return None  # receivers without a fix write zeros
    return latitude, longitude, relative_altitude_m or 0.0


def _degrees(parts: object, hemisphere: object, negative: str, largest: float) -> float | None:
    if not isinstance(parts, tuple) or not parts:
        return None
    numbers = [_number(part) for part in parts[:3]]
    if any(n is None for n in numbers):
        return None
    value = sum((n or 0.0) / 60**i for i, n in enumerate(numbers))
    letter = hemisphere.decode("ascii", "ignore") if isinstance(hemisphere, bytes) else str(hemisphere or "")
    return None if value > largest else -value if letter.strip("\x00 ").upper() == negative else value
