import re
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile

from artifacts.mask_png import write_mask
from artifacts.page import page_key
from artifacts.raster import MosaicRaster, TiffWindows, read_drawn_mask
from schemas.bit_mask import BitMask
from schemas.problem import BadInput

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("channels", [(), (3,)])
@pytest.mark.parametrize("layout", [{"tile": (64, 128)}, {"rowsperstrip": 50}, {}])
@pytest.mark.parametrize("compression", [None, "zlib"])
def test_any_window_of_any_layout(
    tmp_path: Path, channels: tuple[int, ...], layout: dict[str, object], compression: str | None
) -> None:
    pixels = RNG.integers(0, 255, (211, 317, *channels), dtype=np.uint8)
    photometric = "rgb" if channels else "minisblack"
    tifffile.imwrite(tmp_path / "a.tif", pixels, compression=compression, photometric=photometric, **layout)
    windows = TiffWindows(tmp_path / "a.tif", "wall")
    assert (windows.height_px, windows.width_px) == (211, 317)
    for y0, y1, x0, x1 in ((0, 211, 0, 317), (60, 70, 120, 135), (210, 211, 316, 317), (5, 5, 0, 317)):
        assert (windows.read(y0, y1, x0, x1) == pixels[y0:y1, x0:x1]).all()
    windows.close()


def test_sixteen_bits_stay_sixteen_bits(tmp_path: Path) -> None:
    pixels = RNG.integers(0, 60_000, (100, 90), dtype=np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", pixels, tile=(32, 32))
    with closing(TiffWindows(tmp_path / "a.tif", "wall")) as windows:
        assert (windows.read(10, 99, 0, 90) == pixels[10:99]).all()


def test_valid_is_covered_and_not_masked(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "i.tif", np.zeros((50, 60, 3), np.uint8), tile=(32, 32), photometric="rgb")
    covered = np.full((50, 60), 255, np.uint8)
    covered[:10] = 0
    tifffile.imwrite(tmp_path / "c.tif", covered, tile=(32, 32))
    masked = np.zeros((50, 60), dtype=bool)
    masked[:, :5] = True
    write_mask(BitMask.of(masked), tmp_path / "m.png")
    with MosaicRaster(tmp_path / "i.tif", tmp_path / "c.tif", "wall", tmp_path / "m.png") as raster:
        valid = raster.valid(0, 50, 0, 60)
    assert (valid == ((covered > 0) & ~masked)).all()
    write_mask(BitMask.of(masked[:40]), tmp_path / "short.png")
    with pytest.raises(BadInput, match="differ in size"):
        MosaicRaster(tmp_path / "i.tif", tmp_path / "c.tif", "wall", tmp_path / "short.png")


def test_what_is_no_tiff_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.tif").write_text("not a picture")
    with pytest.raises(BadInput, match=r"pier: its mosaic cannot be read"):
        TiffWindows(tmp_path / "a.tif", "pier")


def test_keys_hold_only_what_the_dashboard_takes() -> None:
    assert page_key("cracks", "Web_left (2).JPG") == "cracks-web-left-2-jpg"
    keys = [page_key("cracks", name) for name in ("桥梁", "隧道", "Été", "Ète", "t")]
    assert len(set(keys)) == len(keys)
    assert all(re.fullmatch("[a-z0-9-]+", key) for key in keys)


def lines(*levels: int) -> np.ndarray:
    mask = np.zeros((200, 200), np.uint8)
    for n, level in enumerate(levels):
        cv2.line(mask, (10, 30 + 50 * n), (190, 10 + 60 * n), level, 7)
    return mask


@pytest.mark.parametrize("levels", [(1,), (255,), (1, 2, 200)])
def test_a_drawn_mask_is_what_is_not_0(tmp_path: Path, levels: tuple[int, ...]) -> None:
    cv2.imwrite(str(tmp_path / "m.png"), lines(*levels))
    assert (read_drawn_mask(tmp_path / "m.png", "m.png") == (lines(*levels) > 0)).all()


def test_a_mask_kept_as_jpeg_is_cut_half_way_up(tmp_path: Path) -> None:
    """What rings beside it is no crack."""
    cv2.imwrite(str(tmp_path / "m.jpg"), lines(255, 255), [cv2.IMWRITE_JPEG_QUALITY, 60])
    read = read_drawn_mask(tmp_path / "m.jpg", "m.jpg")
    assert (read != (lines(255, 255) > 0)).sum() < 0.02 * read.sum()


def test_a_mask_that_is_black_on_white_is_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "m.png"), np.uint8(255 * (np.arange(100) > 5)) * np.ones((100, 1), np.uint8))
    with pytest.raises(BadInput, match=r"m.png: marks 94 % .*invert"):
        read_drawn_mask(tmp_path / "m.png", "m.png")


def test_a_mask_drawn_in_the_transparency_is_read(tmp_path: Path) -> None:
    drawn = np.zeros((20, 30), np.uint8)
    drawn[8:11] = 255
    for colour in (0, 255):
        of_one_colour = np.dstack([np.full((20, 30, 3), colour, np.uint8), drawn])
        cv2.imwrite(str(tmp_path / "m.png"), of_one_colour)
        assert (read_drawn_mask(tmp_path / "m.png", "m.png") == (drawn > 0)).all()
    opaque = np.dstack([drawn] * 3 + [np.full_like(drawn, 255)])
    cv2.imwrite(str(tmp_path / "m.png"), opaque)
    assert (read_drawn_mask(tmp_path / "m.png", "m.png") == (drawn > 0)).all()
