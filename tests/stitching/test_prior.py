"""What photos say of their places before any is matched: which plane they show, and how sure its scale is."""

import pytest

from schemas.camera import Camera
from schemas.file import File
from schemas.geodesy import GeoOrigin
from schemas.photo import Photo
from tasks.stitching.prior import plane_frame

ORIGIN = GeoOrigin(latitude_deg=48.0, longitude_deg=11.0)


def photo(east_m: float, north_m: float, up_m: float, pitch_deg: float) -> Photo:
    latitude, longitude, _ = ORIGIN.to_geographic((east_m, north_m, 0.0))
    name = f"{east_m:g}-{north_m:g}.jpg"
    return Photo(
        name=name,
        file=File(sha256="0" * 64, size=1, suffix=".jpg"),
        camera=Camera(width_px=800, height_px=600, focal_px=800.0),
        gps=(latitude, longitude, up_m),
        view_deg=(0.0, pitch_deg, 0.0),
        surface="deck",
        sharpness=1.0,
        exposure=0.5,
    )


@pytest.mark.parametrize(
    ("pitch_deg", "ground"), [(-90.0, True), (-45.0, True), (-30.0, False), (0.0, False)]
)
def test_an_oblique_set_at_45_degrees_shows_the_ground(pitch_deg: float, ground: bool) -> None:
    """Over ground the cameras' height is known; before a wall the distance is not."""
    photos = [photo(10.0 * k, 5.0 * (k % 2), 30.0 + k % 3, pitch_deg) for k in range(6)]
    frame = plane_frame(photos, None)
    heights = [prior.view.C[2] for prior in frame.priors]
    assert (heights == pytest.approx([p.gps[2] for p in photos if p.gps])) == ground
