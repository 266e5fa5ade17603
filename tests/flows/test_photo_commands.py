"""What the commands on photos say beside their results."""

import hashlib
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile

from artifacts import store
from artifacts.mask_png import read_mask
from flows.photo_commands import _warn_of_assumed, detect, detected, stitch
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


def test_blank_and_equal_photos_are_not_inspected_and_earlier_masks_go(tmp_path: Path) -> None:
    images, out = tmp_path / "images", tmp_path / "out"
    images.mkdir()
    wall = drawn_crack(lambda x: 0 * x + 4.0, darkness=0.7).rgb
    for name in ("a.png", "b.png"):
        cv2.imwrite(str(images / name), wall)
    cv2.imwrite(str(images / "black.png"), np.zeros_like(wall))
    detect(images, out=out, method="ridge")
    told = json.loads((out / "cracks.json").read_text())
    assert [(one["name"], one["cracks"]) for one in told["surfaces"]] == [("a.png", 1)]
    assert {one["item"]: one["what"] for one in told["not_inspected"]} == {
        "b.png": "the same picture as a.png",
        "black.png": "underexposed (100% of it is black)",
    }
    for name in ("a.png", "b.png"):
        (images / name).unlink()
    cv2.imwrite(str(images / "c.png"), wall)
    (out / "mine.mask.png").write_bytes(b"the user's")
    detect(images / "c.png", out=out, method="ridge")
    assert sorted(path.name for path in out.iterdir()) == ["c.mask.png", "cracks.json", "mine.mask.png"]


def test_photos_that_cannot_be_read_stand_in_the_results_of_stitching(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (300, 500, 3)).astype(np.uint8)
    wall = cv2.GaussianBlur(noise, (0, 0), 2.0)
    wall = cv2.normalize(wall, None, 0, 255, cv2.NORM_MINMAX)
    for k in range(3):
        cv2.imwrite(str(tmp_path / f"{k}.png"), wall[:, 60 * k : 60 * k + 360])
    (tmp_path / "damaged.jpg").write_text("<html>")
    out = tmp_path / "out"
    stitch(tmp_path, out=out)
    told = json.loads((out / "stitch.json").read_text())
    assert ("damaged.jpg", "is not an image that can be read") in [
        (one["item"], one["what"]) for one in told["left_out"]
    ]
