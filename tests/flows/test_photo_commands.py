"""What the commands on photos say beside their results."""

import hashlib

import pytest

from flows.photo_commands import _warn_of_assumed
from schemas.camera import Camera
from schemas.file import File
from schemas.photo import Photo


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
