"""Photos of a scene, as the camera would have stored them."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime, timedelta
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import ExifTags, Image

from schemas.camera import Camera, CameraPose
from schemas.contract import Vector3
from schemas.geodesy import GeoOrigin
from tasks.simulation.exposure import Motion, expose
from tasks.simulation.scene import Scene
from tasks.simulation.sensor import Image as Pixels
from tasks.simulation.sensor import automatic_gain, develop

SENSOR_WIDTH_MM = 13.2
JPEG_QUALITY = 90
EXPOSURE_SIGMA = 0.04  # of ln(gain): metering is never quite the same
TURN_SIGMA_DEG_S = 0.4  # what the gimbal leaves of the vehicle's shaking
START = datetime(2024, 3, 5, 10, 30)  # the camera's clock at time 0
PHOTOS_AT_ONCE = 2


@dataclass(frozen=True)
class Exposure:
    """One photo to take. `measured`: what the camera writes of its own position, where it knows any."""

    name: str  # of the file, without suffix
    pose: CameraPose
    velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
    time_s: float = 0.0
    measured: CameraPose | None = None


def render(scene: Scene, camera: Camera, pose: CameraPose, velocity_m_s: Vector3, seed: list[int]) -> Pixels:
    """(height, width, 3) uint8 RGB of the scene from `pose` through `camera` (the true one)."""
    rng = np.random.default_rng([scene.seed, *seed])
    turn = np.radians(rng.normal(0.0, TURN_SIGMA_DEG_S, 3))
    light = expose(camera, pose, Motion(np.asarray(velocity_m_s), turn), scene.arrays, scene.look)
    gain = scene.gain or automatic_gain(light)
    return develop(light, camera, gain * float(np.exp(rng.normal(0.0, EXPOSURE_SIGMA))), rng)


def take(
    scene: Scene, exposures: Iterable[Exposure], folder: Path, progress: Callable[[float], None]
) -> None:
    """Write NAME.jpg of each exposure into `folder`. The result does not depend on how many at a time."""
    wanted = list(exposures)

    def one(exposure: Exposure) -> None:
        pixels = render(
            scene, scene.true_camera, exposure.pose, exposure.velocity_m_s, [*exposure.name.encode()]
        )
        jpeg = encode(pixels, scene.camera, exposure, scene.origin)
        (folder / f"{exposure.name}.jpg").write_bytes(jpeg)

    with ThreadPoolExecutor(PHOTOS_AT_ONCE) as pool:
        for done, _ in enumerate(pool.map(one, wanted), start=1):
            progress(done / len(wanted))


def encode(pixels: Pixels, camera: Camera, exposure: Exposure, origin: GeoOrigin | None) -> bytes:
    """JPEG with 4:2:0 colour and EXIF: camera, lens, clock, and the position where the vehicle knows it."""
    exif = Image.Exif()
    exif[ExifTags.Base.Make], exif[ExifTags.Base.Model] = "Hairline", "Simulated camera"
    details = exif.get_ifd(ExifTags.IFD.Exif)
    taken = START + timedelta(seconds=int(exposure.time_s))
    details[ExifTags.Base.DateTimeOriginal] = taken.strftime("%Y:%m:%d %H:%M:%S")
    details[ExifTags.Base.ExposureTime] = camera.shutter_s
    details[ExifTags.Base.FocalLength] = round(camera.focal_px / camera.width_px * SENSOR_WIDTH_MM, 3)
    details[ExifTags.Base.FocalLengthIn35mmFilm] = round(camera.focal_px / camera.width_px * 36.0)
    if origin is not None and exposure.measured is not None:
        latitude, longitude, altitude = origin.to_geographic(exposure.measured.position_m)
        gps = exif.get_ifd(ExifTags.IFD.GPSInfo)
        gps[ExifTags.GPS.GPSLatitudeRef] = "N" if latitude >= 0 else "S"
        gps[ExifTags.GPS.GPSLatitude] = _degrees(latitude)
        gps[ExifTags.GPS.GPSLongitudeRef] = "E" if longitude >= 0 else "W"
        gps[ExifTags.GPS.GPSLongitude] = _degrees(longitude)
        gps[ExifTags.GPS.GPSAltitudeRef] = b"\x01" if altitude < 0 else b"\x00"
        gps[ExifTags.GPS.GPSAltitude] = round(abs(altitude), 3)
    stream = BytesIO()
    Image.fromarray(pixels).save(
        stream, "JPEG", quality=JPEG_QUALITY, subsampling="4:2:0", exif=exif.tobytes()
    )
    return stream.getvalue()


def contact_sheet(paths: Sequence[Path], columns: int = 3, width_px: int = 380) -> Pixels:
    """(height, width, 3) RGB of small copies of the photos, row by row."""
    small = []
    for path in paths:
        with Image.open(path) as photo:
            photo.draft("RGB", (2 * width_px, 2 * width_px))
            height = round(photo.height / photo.width * width_px)
            small.append(np.asarray(photo.convert("RGB").resize((width_px, height))))
    rows = -(-len(small) // columns)
    sheet = np.full((rows * small[0].shape[0], columns * width_px, 3), 255, np.uint8)
    for index, one in enumerate(small):
        y, x = index // columns * small[0].shape[0], index % columns * width_px
        sheet[y : y + one.shape[0], x : x + width_px] = one
    return sheet


def _degrees(value: float) -> tuple[float, float, float]:
    minutes, seconds = divmod(round(abs(value) * 3600, 5), 60)
    degrees, minutes = divmod(minutes, 60)
    return float(degrees), float(minutes), round(seconds, 5)
