"""Tiled TIFFs: what is put in comes out, in any order, the same bytes, readable by others."""

from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from artifacts.mosaic import TILE_PX, Georeference, MosaicWriter, TiledTiff
from artifacts.raster import TiffWindows
from artifacts.store import digest

PLACE = Georeference(0.5, (1.0, 2.0), "surface wall")


def test_windows_in_any_order_make_one_picture(tmp_path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 255, (700, 900, 3)).astype(np.uint8)
    corners = [(x, y) for y in range(0, 700, 2 * TILE_PX) for x in range(0, 900, 2 * TILE_PX)]
    for name, order in (("a.tif", corners), ("b.tif", corners[::-1])):
        with TiledTiff(tmp_path / name, 900, 700, 3, np.uint8, PLACE) as out:
            for x, y in order:
                out.put(x, y, picture[y : y + 2 * TILE_PX, x : x + 2 * TILE_PX])
    assert digest(tmp_path / "a.tif") == digest(tmp_path / "b.tif")
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.tif")), picture)
    windows = TiffWindows(tmp_path / "a.tif", "a")
    np.testing.assert_array_equal(windows.read(123, 456, 200, 890), picture[123:456, 200:890])
    windows.close()
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        tags = file.pages.first.tags
        across, per = tags["XResolution"].value
        assert across / per == pytest.approx(20.0)  # pixels a centimetre at 0.5 mm
        assert tags["Software"].value == "hairline"
        assert tags["ModelPixelScaleTag"].value == (0.0005, 0.0005, 0.0)
        assert tags["ModelTiepointTag"].value[3:5] == pytest.approx((0.99975, 2.00025))
        levels = [page.shape[:2] for page in file.series[0].levels]
        assert levels == [(700, 900), (350, 450), (175, 225)]
        mean = picture.astype(float).reshape(350, 2, 450, 2, 3).mean(axis=(1, 3))
        assert np.abs(file.series[0].levels[1].asarray() - mean).max() <= 0.5
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.tif", "b.tif"]


def test_tiles_of_one_value_and_nearly_so_come_out_as_they_were(tmp_path: Path) -> None:
    """The same value in several tiles, another, and two that are alike but for their last row or column."""
    picture = np.full((2 * TILE_PX, 2 * TILE_PX), 7, np.uint16)
    picture[TILE_PX:, :TILE_PX] = 300
    picture[-1, TILE_PX:], picture[:TILE_PX, -1] = 8, 9
    with TiledTiff(tmp_path / "source.tif", 2 * TILE_PX, 2 * TILE_PX, 1, np.uint16, PLACE) as out:
        out.put(0, 0, picture)
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "source.tif"), picture)


def test_what_never_came_is_blank(tmp_path: Path) -> None:
    with MosaicWriter(tmp_path, 600, 600, None, (0.0, 0.0), "own plane") as out:
        lit = np.full((88, 88), 255, np.uint8)
        out.put(512, 512, np.dstack([lit] * 3), lit, np.full((88, 88), 3, np.uint16))
    assert out.covered_px == 88 * 88
    source = tifffile.imread(out.source)
    assert source.dtype == np.uint16
    assert int(source.sum()) == 3 * 88 * 88
    with tifffile.TiffFile(out.image) as file:
        coarsest = file.series[0].levels[-1].asarray()
    assert coarsest.shape == (150, 150, 3) and (coarsest[128:] > 0).all(axis=2).sum() == 22 * 22


def test_a_failed_mosaic_leaves_nothing_behind(tmp_path: Path) -> None:
    def interrupted() -> None:
        with MosaicWriter(tmp_path, 600, 600, 1.0, (0.0, 0.0), "own plane"):
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError):
        interrupted()
    assert list(tmp_path.iterdir()) == []


def test_a_window_off_the_tiles_is_refused(tmp_path: Path) -> None:
    out = TiledTiff(tmp_path / "c.tif", 600, 600, 1, np.uint8, Georeference(None, (0.0, 0.0), "own plane"))
    with pytest.raises(ValueError, match="does not start on a tile"):
        out.put(7, 0, np.zeros((10, 10), np.uint8))
    out.close()


def test_smaller_levels_have_no_dark_rim(tmp_path: Path) -> None:
    with MosaicWriter(tmp_path, 301, 301, None, (0.0, 0.0), "own plane") as writer:
        ones = np.ones((301, 301), np.uint16)
        writer.put(0, 0, np.full((301, 301, 3), 200, np.uint8), np.full((301, 301), 255, np.uint8), ones)
    for level in range(2):
        assert (tifffile.imread(writer.image, level=level) == 200).all()
