import numpy as np
import pytest

from schemas.raster import ArrayRaster, Pixels
from tasks.detection import shrunk
from tasks.detection.shrunk import Shrunk, filled
from tasks.detection.windows import Window

RGB = np.random.default_rng(0).integers(0, 256, (1001, 777, 3), np.uint8)
WHOLE = Window(0, 1001, 0, 777)
PART = Window(256, 1001, 128, 640)


class Counted(ArrayRaster):
    reads = 0

    def rgb(self, y0: int, y1: int, x0: int, x1: int) -> Pixels:
        Counted.reads += 1
        return super().rgb(y0, y1, x0, x1)


@pytest.mark.parametrize("octave", [0, 1, 2, 3, 4])
def test_what_is_kept_is_what_would_be_read(octave: int) -> None:
    """But for the last row, which is mirrored up to a whole pixel at another size."""
    kept, read = Shrunk(ArrayRaster(RGB)), Shrunk(ArrayRaster(RGB))
    kept.at(WHOLE, 4)
    ours, theirs = kept.at(PART, octave), read.at(PART, octave)
    assert ours.shape == theirs.shape == (-(-745 >> octave), 512 >> octave, 3)
    np.testing.assert_array_equal(ours[:-1], theirs[:-1])


def test_what_lies_elsewhere_is_read_anew() -> None:
    elsewhere = Window(512, 1001, 256, 777)
    moved, read = Shrunk(ArrayRaster(RGB)), Shrunk(ArrayRaster(RGB))
    moved.at(Window(0, 768, 0, 512), 4)
    np.testing.assert_array_equal(moved.at(elsewhere, 3), read.at(elsewhere, 3))


@pytest.mark.parametrize("octave", [1, 2, 3, 4])
def test_a_pixel_is_the_mean_of_those_it_is_made_of(octave: int) -> None:
    at = Shrunk(ArrayRaster(RGB)).at(PART, octave)
    side = 1 << octave
    rows = 745 >> octave
    own = RGB[256 : 256 + rows * side, 128:640].reshape(rows, side, 512 >> octave, side, 3).mean(axis=(1, 3))
    assert np.abs(at[:rows] - own).max() <= 0.5 * octave  # rounded at each half


@pytest.mark.parametrize(("room_px", "finest"), [(777 * 1001 // 4 + 1, 1), (777 * 1001 // 17, 3)])
def test_a_window_is_read_once_as_far_as_memory_allows(
    room_px: int, finest: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shrunk, "KEPT_PX", room_px)
    image = Shrunk(Counted(RGB))
    image.at(WHOLE, 4)
    for octave in range(4, -1, -1):
        before = Counted.reads
        image.at(PART, octave)
        assert (Counted.reads == before) == (octave >= finest)


def test_bands_are_filled_as_the_whole_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hole that lies across the bands' edges, no farther across than what fills it."""
    valid = np.ones(RGB.shape[:2], bool)
    valid[300:420, 100:150] = False
    whole = Shrunk(ArrayRaster(RGB, valid)).at(WHOLE, 2)
    monkeypatch.setattr(shrunk, "BAND_PX", 128 * 777)
    np.testing.assert_array_equal(Shrunk(ArrayRaster(RGB, valid)).at(WHOLE, 2), whole)


def test_what_is_unknown_takes_the_mean_of_what_is_around() -> None:
    rgb, valid = np.full((200, 300, 3), 140, np.uint8), np.ones((200, 300), bool)
    rgb[:, 200:] = 40
    valid[50:100, 20:60] = valid[50:100, 240:280] = False
    rgb[~valid] = 255
    whole = filled(rgb, valid)
    assert (whole[50:100, 20:60] == 140).all() and (whole[50:100, 250:280] == 40).all()
    assert (whole[valid] == rgb[valid]).all()
