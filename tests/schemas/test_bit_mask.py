import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from schemas.bit_mask import BitMask

SIDE = st.integers(1, 60)


@given(SIDE, SIDE, st.data())
def test_any_window_is_what_was_written(height: int, width: int, data: st.DataObject) -> None:
    mask = np.random.default_rng(height * 61 + width).random((height, width)) < 0.5
    bits = BitMask.of(mask)
    y0, x0 = data.draw(st.integers(0, height - 1)), data.draw(st.integers(0, width - 1))
    y1, x1 = data.draw(st.integers(y0, height)), data.draw(st.integers(x0, width))
    assert (bits.read(y0, y1, x0, x1) == mask[y0:y1, x0:x1]).all()
    assert bits.count() == mask.sum()
    y, x = (plane.ravel() for plane in np.mgrid[:height, :width])
    assert (bits.at(y, x) == mask.ravel()).all()


@given(SIDE, SIDE)
def test_pixels_are_set_one_by_one_and_those_outside_are_left_out(height: int, width: int) -> None:
    rng = np.random.default_rng(height * 61 + width)
    y, x = rng.integers(-3, height + 3, 40), rng.integers(-3, width + 3, 40)
    bits = BitMask(height, width)
    bits.set(y, x)
    inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
    assert {*zip(*np.nonzero(bits.whole()), strict=True)} == {*zip(y[inside], x[inside], strict=True)}


def test_it_takes_an_eighth_of_a_byte_a_pixel() -> None:
    assert BitMask(1000, 8001).rows.nbytes == 1000 * 1001
