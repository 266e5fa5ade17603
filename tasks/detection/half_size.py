"""Looking at half the size too: what is wide and not seen there is texture."""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from schemas.bit_mask import BitMask
from schemas.raster import Pixels, Raster
from tasks.connected import Marked
from tasks.detection.components import components

WIDE_PX = 6.5  # what is as wide as this is seen at half the size; thinner things may not be
SEEN = 0.2  # share of its pixels


class HalfSize(NamedTuple):
    """An image at half its size; an odd last row or column is left out."""

    whole: Raster

    @property
    def height_px(self) -> int:
        return self.whole.height_px // 2

    @property
    def width_px(self) -> int:
        return self.whole.width_px // 2

    def rgb(self, y0: int, y1: int, x0: int, x1: int) -> Pixels:
        large = self.whole.rgb(2 * y0, 2 * y1, 2 * x0, 2 * x1)
        return np.asarray(cv2.resize(large, (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA), np.uint8)

    def valid(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.bool_]:
        large = self.whole.valid(2 * y0, 2 * y1, 2 * x0, 2 * x1)
        return np.asarray(large.reshape(y1 - y0, 2, x1 - x0, 2).all(axis=(1, 3)))


def seen_at_half_size(pixels: Marked, half: BitMask) -> Marked:
    """`pixels` less the wide components of which hardly anything was found at half the size."""
    found = components(pixels)
    seen = np.zeros(len(pixels.y), dtype=bool)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            y = np.clip(pixels.y // 2 + down, 0, half.height_px - 1)
            x = np.clip(pixels.x // 2 + right, 0, half.width_px - 1)
            seen |= half.at(y, x)
    share = np.bincount(found.label[seen], minlength=len(found.area_px)) / np.maximum(found.area_px, 1.0)
    return found.keep((share >= SEEN) | (found.width_px < WIDE_PX))
