"""A mosaic that another program made, tile by tile as ours are."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Protocol

import numpy as np
import numpy.typing as npt

from schemas.problem import BadInput
from tasks.stitching.compositing import Pixels, Tile

SIDE_PX = 2048  # of a window
STEP_PX = 256  # that ends of windows are multiples of
PACKED_PX = 1 << 26  # that are packed together, at most: they are unpacked together
REMEDY = (
    "Save it as a tiled TIFF of 8-bit RGB, or RGBA with what is blank transparent:"
    " gdal_translate -co TILED=YES -co COMPRESS=DEFLATE"
)


class Windows(Protocol):
    height_px: int
    width_px: int
    channels: int
    dtype: np.dtype[np.generic]

    @property
    def packed_px(self) -> tuple[int, int]: ...

    def read(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.uint8]: ...


def tiles_of(
    windows: Windows, name: str, nodata: int | None, on_progress: Callable[[float], None]
) -> Iterator[Tile]:
    """nodata: value of all three colours where the mosaic is blank. Raises BadInput by name where the picture
    is of no kind that is known."""
    if windows.dtype != np.uint8 or windows.channels not in (3, 4):
        kind = f"{8 * windows.dtype.itemsize}-bit with {windows.channels} channels"
        raise BadInput(name, f"is a mosaic of another kind ({kind})", REMEDY)
    rows, columns = windows.packed_px
    if rows * columns > PACKED_PX:
        raise BadInput(name, "is a mosaic in one piece: none of it can be read without all of it", REMEDY)
    # strips are unpacked whole: each once
    high, wide = (SIDE_PX, SIDE_PX) if columns < windows.width_px else (STEP_PX, windows.width_px)
    for y, x in product(range(0, windows.height_px, high), range(0, windows.width_px, wide)):
        bottom, right = min(windows.height_px, y + high), min(windows.width_px, x + wide)
        pixels = windows.read(y, bottom, x, right)
        yield Tile(x, y, *_covered(pixels, nodata))
        on_progress((y * windows.width_px + (bottom - y) * right) / (windows.height_px * windows.width_px))


def _covered(pixels: Pixels, nodata: int | None) -> tuple[Pixels, Pixels, npt.NDArray[np.uint16]]:
    """Its colours, 255 where it is not blank, and that no photo is known."""
    rgb = np.ascontiguousarray(pixels[..., :3])
    seen = np.ones(pixels.shape[:2], dtype=bool) if pixels.shape[2] == 3 else pixels[..., 3] > 0
    if nodata is not None:
        seen &= (rgb != nodata).any(axis=2)
    rgb[~seen] = 0
    return rgb, np.where(seen, np.uint8(255), np.uint8(0)), np.zeros(seen.shape, dtype=np.uint16)
