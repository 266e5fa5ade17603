"""A mosaic that another program made, tile by tile as ours are."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Protocol

import numpy as np
import numpy.typing as npt

from schemas.problem import BadInput
from tasks.stitching.compositing import Pixels, Tile

SIDE_PX = 2048  # of a tile
PACKED_PX = 1 << 26  # that are packed together, at most: they are unpacked together
REMEDY = "Save it as a tiled TIFF of 8-bit RGB, or RGBA with what is blank transparent"


class Windows(Protocol):
    height_px: int
    width_px: int
    channels: int
    dtype: np.dtype[np.generic]
    packed_px: int  # pixels that are packed together

    def read(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.uint8]: ...


def tiles_of(windows: Windows, name: str, on_progress: Callable[[float], None]) -> Iterator[Tile]:
    """Raises BadInput by name where the picture is of no kind that is known."""
    if windows.dtype != np.uint8 or windows.channels not in (3, 4):
        kind = f"{8 * windows.dtype.itemsize}-bit with {windows.channels} channels"
        raise BadInput(name, f"is a mosaic of another kind ({kind})", REMEDY)
    if windows.packed_px > PACKED_PX:
        raise BadInput(name, "is a mosaic in one piece: none of it can be read without all of it", REMEDY)
    corners = product(range(0, windows.height_px, SIDE_PX), range(0, windows.width_px, SIDE_PX))
    for y, x in corners:
        bottom, right = min(windows.height_px, y + SIDE_PX), min(windows.width_px, x + SIDE_PX)
        pixels = windows.read(y, bottom, x, right)
        yield Tile(x, y, *_covered(pixels))
        on_progress((y * windows.width_px + (bottom - y) * right) / (windows.height_px * windows.width_px))


def _covered(pixels: Pixels) -> tuple[Pixels, Pixels, npt.NDArray[np.uint16]]:
    """Its colours, 255 where it is not transparent, and that no photo is known."""
    rgb = np.ascontiguousarray(pixels[..., :3])
    seen = np.ones(pixels.shape[:2], dtype=bool) if pixels.shape[2] == 3 else pixels[..., 3] > 0
    rgb[~seen] = 0
    return rgb, np.where(seen, np.uint8(255), np.uint8(0)), np.zeros(seen.shape, dtype=np.uint16)
