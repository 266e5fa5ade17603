"""How the stages look into a large image without holding all of it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[np.uint8]


class Raster(Protocol):
    """An 8-bit RGB image of any size and what is known of it, read window by window."""

    @property
    def height_px(self) -> int: ...

    @property
    def width_px(self) -> int: ...

    def rgb(self, y0: int, y1: int, x0: int, x1: int) -> Pixels:
        """(y1 − y0, x1 − x0, 3) of rows y0..y1 and columns x0..x1, inside the image."""

    def valid(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.bool_]:
        """(y1 − y0, x1 − x0): False where no photo covers the pixel (or a mask takes it out)."""


@dataclass(frozen=True)
class ArrayRaster:
    """An image in memory. pixels: (H, W, 3) uint8; known: (H, W) bool, None where all of it is."""

    pixels: Pixels
    known: npt.NDArray[np.bool_] | None = None

    @property
    def height_px(self) -> int:
        return int(self.pixels.shape[0])

    @property
    def width_px(self) -> int:
        return int(self.pixels.shape[1])

    def rgb(self, y0: int, y1: int, x0: int, x1: int) -> Pixels:
        return self.pixels[y0:y1, x0:x1]

    def valid(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.bool_]:
        if self.known is None:
            return np.ones((y1 - y0, x1 - x0), dtype=bool)
        return self.known[y0:y1, x0:x1]


Progress = Callable[[float], None]  # told the share of the work that is done, 0..1
