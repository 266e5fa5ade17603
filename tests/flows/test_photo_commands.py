"""What the commands on photos say beside their results."""

import hashlib
from pathlib import Path

import pytest
import tifffile

from artifacts import store
from artifacts.mask_png import read_mask
from flows.photo_commands import _warn_of_assumed, detected
from schemas.camera import Camera
from schemas.file import File
from schemas.photo import Photo
from schemas.settings import DetectSettings
from tasks.photos import reading
from tests.measurement.drawn_crack import drawn_crack


def photo(name: str, camera_from: str) -> Photo:
    return Photo(
        name=name,
        file=File(sha256=hashlib.sha256(name.encode()).hexdigest(), size=1, suffix=".jpg"),
        camera=Camera(width_px=400, height_px=300, focal_px=480.0),
        camera_from=camera_from,
        surface="wall",
        sharpness=0.2,
        exposure=0.5,
    )


def test_photos_without_a_focal_length_are_named_with_what_to_state(
    capsys: pytest.CaptureFixture[str],
) -> None:
    known = photo("known.jpg", "EXIF focal length and sensor")
    _warn_of_assumed([known])
    assert capsys.readouterr().err == ""
    _warn_of_assumed([known, *(photo(f"[{k}].jpg", "assumed: 1.2 × its longer side") for k in range(7))])
    said = capsys.readouterr().err
    assert "[0].jpg, [1].jpg" in said
    assert "and 2 more" in said
    assert "known.jpg" not in said
    assert "--camera" in said
    assert "focal_px" in said


def test_a_mosaic_too_large_for_a_photo_is_seen_through_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wall = drawn_crack(lambda x: 0 * x + 4.0, darkness=0.7).rgb
    tifffile.imwrite(tmp_path / "wall.tif", wall, photometric="rgb", tile=(64, 64))
    masks = []
    for most_px in (reading.LARGEST_PHOTO_PX, 1000):
        monkeypatch.setattr(reading, "LARGEST_PHOTO_PX", most_px)
        with store.temporary() as files:
            found = detected(tmp_path / "wall.tif", DetectSettings(method="ridge"), 0.5)
            assert len(found.mosaic.photos) == (most_px > 1000) and len(found.measurement.cracks) == 1
            masks.append(read_mask(files.path(found.detection.mask), "wall").whole())
    assert masks[0].any() and (masks[0] == masks[1]).all()
