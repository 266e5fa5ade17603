"""EXIF and XMP as drones and phones write them, and as nobody should."""

import pytest
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from tasks.photos.intrinsics import camera_from_metadata
from tasks.photos.metadata import Metadata, read_metadata, taken_s
from tasks.photos.reading import read_photo
from tests.development_data import development_data

NOTHING = Metadata(None, None, None, None, None, None)

DJI = b"""<rdf:Description drone-dji:RelativeAltitude="+39.80" drone-dji:GimbalRollDegree="+0.00"
 drone-dji:GimbalYawDegree="+45.00" drone-dji:GimbalPitchDegree="-89.90"/>"""


def exif_with(gps: dict[int, object], camera: dict[int, object] | None = None) -> Image.Exif:
    exif = Image.Exif()
    exif.get_ifd(0x8825).update(gps)
    exif.get_ifd(0x8769).update(camera or {})
    return exif


def test_a_photo_that_says_nothing() -> None:
    assert read_metadata(Image.Exif(), b"") == NOTHING


def test_place_and_view_of_a_dji_photo() -> None:
    exif = exif_with(
        {1: "N", 2: (46.0, 50.0, 33.3855), 3: "W", 4: (91.0, 59.0, 40.4156)}, {37386: 3.61, 41989: 20}
    )
    found = read_metadata(exif, DJI)
    assert found.gps == pytest.approx((46.84260708, -91.99455989, 39.8), abs=1e-7)
    assert found.view_deg == (45.0, -89.9, 0.0)
    assert (found.focal_mm, found.focal_35mm) == (3.61, 20.0)


def test_speed_of_a_dji_photo_is_east_north_up() -> None:
    speeds = b'drone-dji:FlightXSpeed="+3.0" drone-dji:FlightYSpeed="-1.5" drone-dji:FlightZSpeed="+0.2"'
    assert read_metadata(Image.Exif(), speeds).velocity_m_s == (-1.5, 3.0, -0.2)
    assert read_metadata(Image.Exif(), speeds.replace(b"ZSpeed", b"ZSpin")).velocity_m_s is None


@pytest.mark.parametrize(
    ("camera", "ev"),
    [
        ({33434: IFDRational(1, 500), 34855: 400, 33437: 2.0}, -8.966),  # log2(1/500 · 4 / 4)
        ({33434: IFDRational(1, 500), 34855: (400, 400), 33437: 2.0}, -8.966),
        ({33434: IFDRational(1, 500), 33437: 2.0}, None),
        ({33434: 0, 34855: 400, 33437: 2.0}, None),
        ({33434: "fast", 34855: 400, 33437: 2.0}, None),
    ],
)
def test_exposure_is_told_by_all_three_or_not_at_all(camera: dict[int, object], ev: float | None) -> None:
    assert read_metadata(exif_with({}, camera), b"").metered_ev == pytest.approx(ev, abs=1e-3)


@pytest.mark.parametrize(
    ("camera", "taken"),
    [
        ({0x9003: "1970:01:02 00:00:01", 0x9291: "25"}, 86401.25),
        ({0x9003: "1970:01:02 00:00:01\x00"}, 86401.0),
        ({0x9003: "1970:01:02 00:00:01", 0x9291: "  "}, 86401.0),
        ({0x9003: "0000:00:00 00:00:00"}, None),
        ({0x9003: b"noon"}, None),
        ({}, None),
    ],
)
def test_when_a_photo_was_taken(camera: dict[int, object], taken: float | None) -> None:
    assert taken_s(exif_with({}, camera)) == taken


def test_a_gimbal_rolled_over_looks_where_it_looks() -> None:
    """DJI: pitch −88, roll 180, yaw 10 is pitch −92 at yaw 190 unrolled."""
    xmp = b'GimbalRollDegree="180.0" GimbalYawDegree="10.0" GimbalPitchDegree="-88.0"'
    assert read_metadata(Image.Exif(), xmp).view_deg == (190.0, -92.0, 0.0)


@pytest.mark.parametrize(
    "gps",
    [
        {1: "N", 2: (0.0, 0.0, 0.0), 3: "E", 4: (0.0, 0.0, 0.0)},  # no fix
        {1: "N", 2: (460.0, 0.0, 0.0), 3: "E", 4: (8.0, 0.0, 0.0)},
        {1: "N", 2: (float("nan"), 0.0, 0.0), 3: "E", 4: (8.0, 0.0, 0.0)},
        {1: "N", 2: (IFDRational(1, 0), IFDRational(0, 0), 0.0), 3: "E", 4: (8.0, 0.0, 0.0)},
        {1: "N", 2: "46", 3: "E", 4: (8.0, 0.0, 0.0)},
        {2: (46.0, 1.0, 2.0)},
    ],
)
def test_gps_that_cannot_be_is_no_gps(gps: dict[int, object]) -> None:
    assert read_metadata(exif_with(gps), b"").gps is None


@pytest.mark.parametrize(
    ("found", "focal_px", "source"),
    [
        (Metadata(8.8, 24.0, None, 3666.7, None, None), 3666.7, "XMP"),
        (Metadata(8.8, 24.0, 414.5, None, None, None), 3647.6, "sensor"),
        (Metadata(8.8, 24.0, None, None, None, None), 3647.7, "35-mm"),  # 1-inch sensor, 3:2, 5472 × 3648 px
        (Metadata(8.8, None, None, None, None, None), 6566.4, "assumed"),
        (NOTHING, 6566.4, "assumed"),
    ],
)
def test_focal_length_by_the_best_evidence(found: Metadata, focal_px: float, source: str) -> None:
    """DJI FC6310: 8.8 mm behind a sensor of 13.2 mm, 5472 px wide: 3648 px."""
    camera, told, sigma = camera_from_metadata(5472, 3648, found)
    assert camera.focal_px == pytest.approx(focal_px, rel=1e-3)
    assert source in told
    assert 0 < sigma <= 0.3


@pytest.mark.parametrize(
    ("size_px", "stated_px", "focal_px"),
    [
        ((1368, 912), (5472, 3648), 912.0),  # a quarter of what EXIF says
        ((912, 1368), (5472, 3648), 912.0),  # and set upright
        ((1500, 1000), (5472, 3648), 1000.0),
        ((5472, 3648), (5472, 3648), 3648.0),
        ((2736, 3648), (5472, 3648), 3648.0),  # cut, not shrunk
    ],
)
@pytest.mark.parametrize("calibrated", [None, 3648.0])
def test_a_shrunk_photo_has_a_shorter_focal_length(
    calibrated: float | None, size_px: tuple[int, int], stated_px: tuple[int, int], focal_px: float
) -> None:
    """DJI FC6310, whose EXIF and XMP came through the shrinking as they were."""
    exif = exif_with({}, {0x920A: 8.8, 0xA20E: 414.5, 0xA210: 4, 0xA002: stated_px[0], 0xA003: stated_px[1]})
    xmp = b"" if calibrated is None else b'drone-dji:CalibratedFocalLength="3648.0"'
    camera, _, _ = camera_from_metadata(*size_px, read_metadata(exif, xmp))
    assert camera.focal_px == pytest.approx(focal_px, rel=1e-3)


def test_wide_photos_are_crops_of_a_4_3_sensor() -> None:
    """DJI FC300S at 16:9: 3.61 mm, pixels of 1.56 µm: 2311 px."""
    found = Metadata(3.61, 20.0, None, None, None, None)
    assert camera_from_metadata(4000, 2250, found)[0].focal_px == pytest.approx(2311, rel=0.01)


def test_real_drone_photo() -> None:
    path = development_data("photos/brighton_beach") / "DJI_0024.JPG"
    decoded = read_photo(path, path.name)
    found = read_metadata(decoded.exif, decoded.xmp)
    assert decoded.as_it_came
    assert found.gps == pytest.approx((46.8428646, -91.9936967, 39.9), abs=1e-6)
    assert found.view_deg == pytest.approx((-140.0, -89.9, 0.0))
    assert found.focal_35mm == 20
