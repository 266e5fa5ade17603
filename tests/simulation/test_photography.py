import hashlib
import subprocess
import sys
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import ExifTags, Image

from schemas.camera import CameraPose
from tasks.simulation import photography
from tasks.simulation.bridge import ORIGIN, bridge
from tasks.simulation.photography import Exposure, contact_sheet, encode, take
from tasks.simulation.scene import Scene
from tasks.simulation.wall import WALL, wall, wall_poses

SCRIPT = """
import sys
from pathlib import Path
from tests.simulation.test_photography import small_wall, exposures
from tasks.simulation.photography import take
take(small_wall(), exposures(), Path(sys.argv[1]), lambda _: None)
"""


def small_wall() -> Scene:
    scene = wall(1)
    return replace(scene, camera=scene.camera.model_copy(update={"width_px": 200, "height_px": 150}))


def exposures() -> list[Exposure]:
    return [Exposure(name, true, (0.1, 0.0, 0.05)) for name, true, _ in wall_poses(1)[:3]]


def digests(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.iterdir())}


def test_photos_do_not_depend_on_threads_or_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = [tmp_path / n for n in ("one", "two", "other")]
    for folder in folders:
        folder.mkdir()
    take(small_wall(), exposures(), folders[0], lambda _: None)
    monkeypatch.setattr(photography, "PHOTOS_AT_ONCE", 1)
    take(small_wall(), exposures(), folders[1], lambda _: None)
    root = Path(__file__).parents[2]
    subprocess.run([sys.executable, "-c", SCRIPT, str(folders[2])], check=True, cwd=root)
    assert len(digests(folders[0])) == 3
    assert digests(folders[0]) == digests(folders[1]) == digests(folders[2])


def test_two_photos_of_one_place_differ_only_by_noise_and_exposure(tmp_path: Path) -> None:
    _, pose, _ = wall_poses(1)[12]
    take(small_wall(), [Exposure("a", pose), Exposure("b", pose)], tmp_path, lambda _: None)
    a, b = (np.asarray(Image.open(tmp_path / f"{n}.jpg")).astype(float) for n in "ab")
    assert 0 < np.abs(a - b).mean() < 20


def test_the_true_camera_is_nearly_the_calibrated_one() -> None:
    scene = bridge(1)
    assert scene.true_camera != scene.camera
    assert scene.true_camera.focal_px == pytest.approx(scene.camera.focal_px, rel=3e-3)
    assert scene.true_camera.principal_px == pytest.approx(scene.camera.principal_px, abs=4.0)


def test_exif_tells_camera_lens_clock_and_where_it_was() -> None:
    camera = bridge(1).camera
    where = CameraPose(position_m=(12.0, -30.0, 5.0), yaw_deg=0.0, pitch_deg=0.0)
    pixels = np.full((60, 80, 3), 128, np.uint8)
    picture = Image.open(
        BytesIO(encode(pixels, camera, Exposure("a", where, time_s=61.5, measured=where), ORIGIN))
    )
    exif = picture.getexif()
    assert exif[ExifTags.Base.Model] == "Simulated camera"
    details = exif.get_ifd(ExifTags.IFD.Exif)
    assert details[ExifTags.Base.FocalLengthIn35mmFilm] == 88
    assert float(details[ExifTags.Base.FocalLength]) == pytest.approx(4000 / 1632 * 13.2, abs=0.01)
    assert details[ExifTags.Base.DateTimeOriginal] == "2024:03:05 10:31:01"
    gps = exif.get_ifd(ExifTags.IFD.GPSInfo)
    degrees = [sum(float(x) / 60**k for k, x in enumerate(gps[tag])) for tag in (2, 4)]
    latitude = -degrees[0] if gps[1] == "S" else degrees[0]
    east, north, up = ORIGIN.to_enu(latitude, degrees[1], float(gps[6]))
    assert (east, north, up) == pytest.approx((12.0, -30.0, 5.0), abs=0.01)
    assert picture.layer[0][1:3] == (2, 2) and picture.layer[1][1:3] == (1, 1)  # 4:2:0


def test_a_photo_from_an_unknown_place_claims_none() -> None:
    pose = wall_poses(1)[0][1]
    jpeg = encode(np.zeros((8, 8, 3), np.uint8), wall(1).camera, Exposure("a", pose), None)
    assert not Image.open(BytesIO(jpeg)).getexif().get_ifd(ExifTags.IFD.GPSInfo)


def test_patterns_are_pink_and_panels_brown() -> None:
    scene = wall(1)
    surface = scene.face(WALL).surface()
    _, pose, _ = wall_poses(1)[12]
    pixels = photography.render(scene, scene.true_camera, pose, (0.0, 0.0, 0.0), [1])
    middles = scene.true_camera.project(surface.to_world([m.centre_uv_m for m in scene.markers]), pose)
    inside = [
        pixels[round(y), round(x)].astype(int)
        for x, y in middles
        if 5 < x < scene.camera.width_px - 5 and 5 < y < scene.camera.height_px - 5
    ]
    assert inside
    for red, green, blue in inside:
        assert red > green + 40 and blue > green + 15
    red, green, blue = np.median(pixels.reshape(-1, 3), axis=0)
    assert red > green > blue


def test_a_contact_sheet_shows_photos_of_one_size_in_rows(tmp_path: Path) -> None:
    paths = []
    for grey in (30, 90, 150, 210):
        paths.append(tmp_path / f"{grey}.jpg")
        Image.new("RGB", (160, 120), (grey, grey, grey)).save(paths[-1])
    sheet = contact_sheet(paths, columns=3, width_px=80)
    assert sheet.shape == (120, 240, 3)
    assert [int(sheet[30, x, 0]) for x in (40, 120, 200)] == pytest.approx([30, 90, 150], abs=2)
    assert sheet[90, 40, 0] == pytest.approx(210, abs=2) and sheet[90, 120, 0] == 255
