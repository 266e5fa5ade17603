"""Mosaics that other programs made."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from artifacts import store
from artifacts.geotiff import told_by
from artifacts.mosaic import Georeference, TiledTiff
from artifacts.raster import MosaicRaster, TiffWindows
from schemas.problem import BadInput
from tasks.photos.task import is_mosaic
from tasks.stitching import given
from tasks.stitching.task import given_mosaic

RNG = np.random.default_rng(4)


def rgba(height: int = 2500, width: int = 2300) -> np.ndarray:
    pixels = RNG.integers(1, 255, (height // 50, width // 50, 4), np.uint8).repeat(50, 0).repeat(50, 1)
    pixels[..., 3] = 255
    pixels[:, :400, 3] = 0
    return pixels


@pytest.mark.parametrize("form", [{"tile": (512, 512)}, {"rowsperstrip": 64}], ids=["tiles", "strips"])
def test_what_is_transparent_is_blank_and_the_rest_as_it_was(form: dict, tmp_path: Path) -> None:
    pixels = rgba()
    tifffile.imwrite(tmp_path / "wall.tif", pixels, photometric="rgb", extrasamples=["unassalpha"], **form)
    with store.temporary() as files:
        mosaic = given_mosaic(files.put(tmp_path / "wall.tif"), "wall.tif", 0.5)
        assert (mosaic.name, mosaic.width_px, mosaic.height_px) == ("wall", 2300, 2500)
        assert mosaic.covered_m2 == pytest.approx(1900 * 2500 * 0.25e-6)
        paths = files.path(mosaic.image), files.path(mosaic.coverage)
        with MosaicRaster(*paths, "wall") as raster:
            assert (raster.rgb(0, 2500, 400, 2300) == pixels[:, 400:, :3]).all()
            assert (raster.valid(0, 2500, 0, 2300) == (pixels[..., 3] > 0)).all()


def test_without_transparency_all_of_it_is_known(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "wall.tif", rgba()[..., :3], photometric="rgb", tile=(256, 256))
    with store.temporary() as files:
        mosaic = given_mosaic(files.put(tmp_path / "wall.tif"), "wall.tif", None)
        assert mosaic.gsd_mm_px is None and mosaic.covered_m2 is None
        with closing(TiffWindows(files.path(mosaic.coverage), "wall")) as windows:
            assert windows.read(0, 2500, 0, 2300).min() == 255


@pytest.mark.parametrize(
    ("pixels", "photometric", "said"),
    [
        (np.zeros((300, 300), np.uint16), "minisblack", "16-bit with 1 channels"),
        (np.zeros((300, 300, 3), np.float32), "rgb", "32-bit with 3 channels"),
    ],
)
def test_another_kind_is_refused_with_what_to_do(
    pixels: np.ndarray, photometric: str, said: str, tmp_path: Path
) -> None:
    tifffile.imwrite(tmp_path / "dem.tif", pixels, tile=(64, 64), photometric=photometric)
    with store.temporary() as files, pytest.raises(BadInput, match=rf"dem.tif.*{said}.*8-bit RGB"):
        given_mosaic(files.put(tmp_path / "dem.tif"), "dem.tif", None)


@pytest.mark.parametrize(("packing", "most"), [("tiff_lzw", 0), ("jpeg", 30), ("tiff_adobe_deflate", 0)])
def test_mosaics_are_read_however_they_are_packed(packing: str, most: int, tmp_path: Path) -> None:
    """As libtiff writes them, which Metashape, Pix4D and GDAL write with."""
    pixels = rgba(300, 400)[..., :3]
    Image.fromarray(pixels).save(tmp_path / "wall.tif", compression=packing)
    with store.temporary() as files:
        mosaic = given_mosaic(files.put(tmp_path / "wall.tif"), "wall.tif", None)
        with closing(TiffWindows(files.path(mosaic.image), "wall")) as windows:
            off = np.abs(windows.read(0, 300, 0, 400).astype(int) - pixels)
    # JPEG shares a block's colour: at the edges of ours it is off by more
    assert np.percentile(off, 90) <= most and off[25::50, 25::50].max() <= most


def test_what_no_codec_unpacks_or_lies_in_planes_is_told_with_what_to_do(tmp_path: Path) -> None:
    pixels = rgba(300, 400)[..., :3]
    tifffile.imwrite(tmp_path / "odd.tif", pixels, photometric="rgb", tile=(64, 64))
    with tifffile.TiffFile(tmp_path / "odd.tif", mode="r+b") as file:
        file.pages[0].tags["Compression"].overwrite(64_999)
    planes = np.moveaxis(pixels, -1, 0)
    tifffile.imwrite(
        tmp_path / "planes.tif", planes, planarconfig="separate", photometric="rgb", tile=(64, 64)
    )
    for name, said in (("odd.tif", "64999"), ("planes.tif", "colours lie apart")):
        with store.temporary() as files, pytest.raises(BadInput, match=rf"{name}.*{said}.*COMPRESS=DEFLATE"):
            given_mosaic(files.put(tmp_path / name), name, None)


def test_strips_are_unpacked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tifffile.imwrite(tmp_path / "wall.tif", rgba()[..., :3], photometric="rgb", rowsperstrip=64)
    unpacked, unpack = [], TiffWindows._tile
    monkeypatch.setattr(TiffWindows, "_tile", lambda self, n: unpacked.append(n) or unpack(self, n))
    with store.temporary() as files:
        given_mosaic(files.put(tmp_path / "wall.tif"), "wall.tif", None)
    assert sorted(unpacked) == list(range(-(-2500 // 64)))


def test_what_can_only_be_read_at_once_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(given, "PACKED_PX", 1000)
    tifffile.imwrite(tmp_path / "wall.tif", rgba()[..., :3], photometric="rgb", rowsperstrip=2500)
    with store.temporary() as files, pytest.raises(BadInput, match=r"in one piece.*tiled"):
        given_mosaic(files.put(tmp_path / "wall.tif"), "wall.tif", None)


def test_the_size_is_known_without_reading_and_whatever_it_is(tmp_path: Path) -> None:
    path = tmp_path / "sparse.tif"
    with tifffile.TiffWriter(path, bigtiff=True) as writer:
        blank = (b"" for _ in range(200 * 160))
        writer.write(blank, shape=(80_000, 100_000, 3), dtype=np.uint8, tile=(512, 512), photometric="rgb")
    told = told_by(path)
    assert told is not None and (told.width_px, told.height_px) == (100_000, 80_000)
    (tmp_path / "no.tif").write_bytes(path.read_bytes()[:12])
    (tmp_path / "text.tif").write_text("text")
    assert told_by(tmp_path / "no.tif") is None and told_by(tmp_path / "text.tif") is None


def geotiff(path: Path, steps: tuple[float, float], **keys: int) -> Path:
    """Its pixels are `steps` apart in the map's unit; keys by their GeoTIFF number, as _1024=1."""
    entries = [
        n for key, value in sorted((int(k[1:]), v) for k, v in keys.items()) for n in (key, 0, 1, value)
    ]
    tags = [(33550, "d", 3, (*steps, 0.0), True), (33922, "d", 6, (0, 0, 0, 5e5, 5e6, 0.0), True)]
    tags += [(34735, "H", 4 + len(entries), (1, 1, 0, len(keys), *entries), True)] if keys else []
    tifffile.imwrite(path, rgba(300, 400)[..., :3], photometric="rgb", tile=(64, 64), extratags=tags)
    return path


@pytest.mark.parametrize(
    ("steps", "keys", "gsd_mm_px"),
    [
        ((0.0004, 0.0004), {}, 0.4),
        ((0.0004, 0.0004), {"_1024": 1, "_3072": 32632, "_3076": 9001}, 0.4),
        ((0.001, 0.001), {"_1024": 1, "_3072": 2263, "_3076": 9003}, 0.3048),  # US survey feet
        ((4e-9, 4e-9), {"_1024": 2, "_2048": 4326}, None),  # degrees
        ((0.0004, 0.0004), {"_1024": 1, "_3072": 3857}, None),  # Web Mercator's metres are none
        ((0.0004, 0.0007), {}, None),
        ((1.0, 1.0), {}, None),  # pixels
    ],
)
def test_a_mosaic_on_a_map_tells_its_scale(
    steps: tuple[float, float], keys: dict[str, int], gsd_mm_px: float | None, tmp_path: Path
) -> None:
    path = geotiff(tmp_path / "wall.tif", steps, **keys)
    with store.temporary() as files:
        file = files.put(path)
        assert is_mosaic(file)
        mosaic = given_mosaic(file, "wall.tif", None)
        assert mosaic.gsd_mm_px == (None if gsd_mm_px is None else pytest.approx(gsd_mm_px, rel=1e-5))
        assert given_mosaic(file, "wall.tif", 0.7).gsd_mm_px == 0.7


def test_our_own_mosaic_comes_back_with_its_scale_and_its_blank_parts(tmp_path: Path) -> None:
    place = Georeference(0.5, (0.0, 0.0), "wall")
    with TiledTiff(tmp_path / "wall.tif", 700, 300, 3, np.uint8, place) as tiff:
        tiff.put(256, 0, np.full((256, 256, 3), 90, np.uint8))
    with store.temporary() as files:
        file = files.put(tmp_path / "wall.tif")
        assert is_mosaic(file)
        mosaic = given_mosaic(file, "wall.tif", None)
        assert mosaic.gsd_mm_px == 0.5
        with closing(TiffWindows(files.path(mosaic.coverage), "wall")) as windows:
            known = windows.read(0, 300, 0, 700) > 0
    assert known[:256, 256:512].all() and known.sum() == 256 * 256


def test_a_photo_saved_as_tiff_is_no_mosaic_but_what_is_transparent_is(tmp_path: Path) -> None:
    Image.fromarray(rgba(300, 400)[..., :3]).save(tmp_path / "photo.tif")
    Image.fromarray(rgba(300, 400)).save(tmp_path / "cut.tif")
    tifffile.imwrite(
        tmp_path / "infrared.tif", rgba(300, 400), photometric="rgb", extrasamples=["unspecified"]
    )
    with store.temporary() as files:
        known = [is_mosaic(files.put(tmp_path / f"{name}.tif")) for name in ("photo", "cut", "infrared")]
    assert known == [False, True, False]
