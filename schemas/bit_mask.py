"""Which pixels of a large image are meant: one bit each, so that a mosaic of any size fits in memory."""

from collections.abc import Iterator
from typing import Self

import numpy as np
import numpy.typing as npt

BAND_PX = 512  # rows that are unpacked together


class BitMask:
    """(height_px, width_px) of False and True, read and written window by window.

    rows: (H, ⌈W / 8⌉) uint8, the leftmost pixel in the highest bit; the last bits of a row are 0."""

    def __init__(self, height_px: int, width_px: int) -> None:
        self.height_px, self.width_px = height_px, width_px
        self.rows: npt.NDArray[np.uint8] = np.zeros((height_px, -(-width_px // 8)), dtype=np.uint8)

    @classmethod
    def of(cls, mask: npt.NDArray[np.bool_]) -> Self:
        """Of an (H, W) array."""
        made = cls(*mask.shape)
        made.write(0, 0, mask)
        return made

    @classmethod
    def at_pixels(
        cls, height_px: int, width_px: int, y: npt.NDArray[np.int32], x: npt.NDArray[np.int32]
    ) -> Self:
        """True at the (n,) pixels given."""
        made = cls(height_px, width_px)
        made.set(y, x)
        return made

    def set(self, y: npt.NDArray[np.integer], x: npt.NDArray[np.integer]) -> None:
        """True at the (n,) pixels given; those outside are left out."""
        inside = (y >= 0) & (y < self.height_px) & (x >= 0) & (x < self.width_px)
        y, x = y[inside], x[inside]
        np.bitwise_or.at(self.rows, (y, x >> 3), np.uint8(128) >> (x & 7).astype(np.uint8))

    def write(self, top: int, left: int, part: npt.NDArray[np.bool_]) -> None:
        """(h, w) from row `top` and column `left` on. It begins at a multiple of 8 columns and ends at one or
        with the image: so parts that overlap nowhere may be written at the same time."""
        height, width = part.shape
        assert left % 8 == 0 and (width % 8 == 0 or left + width == self.width_px)
        self.rows[top : top + height, left // 8 : -(-(left + width) // 8)] = np.packbits(part, axis=1)

    def read(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.bool_]:
        """(y1 − y0, x1 − x0) of rows y0..y1 and columns x0..x1."""
        first = x0 >> 3
        bits = np.unpackbits(self.rows[y0:y1, first : -(-x1 // 8)], axis=1)
        return bits[:, x0 - 8 * first : x1 - 8 * first].view(np.bool_)

    def at(self, y: npt.NDArray[np.integer], x: npt.NDArray[np.integer]) -> npt.NDArray[np.bool_]:
        """(n,) at the (n,) pixels given, all of them inside."""
        return np.asarray((self.rows[y, x >> 3] >> (7 - (x & 7)).astype(np.uint8)) & 1, dtype=bool)

    def bands(self) -> Iterator[tuple[int, npt.NDArray[np.bool_]]]:
        """All of it from the top: the first row of each band, and the band."""
        for top in range(0, self.height_px, BAND_PX):
            yield top, self.read(top, min(self.height_px, top + BAND_PX), 0, self.width_px)

    def whole(self) -> npt.NDArray[np.bool_]:
        """(H, W): for images that fit in memory."""
        return self.read(0, self.height_px, 0, self.width_px)

    def count(self) -> int:
        return sum(
            int(np.bitwise_count(self.rows[top : top + BAND_PX]).sum(dtype=np.int64))
            for top in range(0, self.height_px, BAND_PX)
        )
