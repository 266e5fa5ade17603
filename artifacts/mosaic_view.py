"""A mosaic to look at: windows of it at any reduction, never the whole of it in memory."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import cv2
import numpy as np
import numpy.typing as npt

from artifacts.raster import TiffWindows
from schemas.bit_mask import BitMask
from schemas.file import File
from schemas.mosaic import Mosaic

Pixels = npt.NDArray[np.uint8]
OpenFile = Callable[[File], Path]
BAND_PX = 4_000_000  # decoded at a time
HATCH = ((236, 239, 242), (205, 211, 217))  # of what no photo covers: ground and lines
HATCH_PERIOD_PX, HATCH_LINE_PX = 9, 2


@dataclass(frozen=True)
class Window:
    """Pixels x0..x1, y0..y1 (the ends not included) of a mosaic."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width_px(self) -> int:
        return self.x1 - self.x0

    @property
    def height_px(self) -> int:
        return self.y1 - self.y0

    def reduced_size(self, most_px: int, highest_px: int | None = None) -> tuple[int, int]:
        """Width and height of a picture of it, at most `most_px` wide and `highest_px` (as wide) high."""
        scale = min(1.0, most_px / self.width_px, (highest_px or most_px) / self.height_px)
        return max(1, round(self.width_px * scale)), max(1, round(self.height_px * scale))


class MosaicView:
    def __init__(self, mosaic: Mosaic, open_file: OpenFile) -> None:
        self.mosaic = mosaic
        with ExitStack() as opened:
            self._image = TiffWindows(open_file(mosaic.image), mosaic.name)
            opened.callback(self._image.close)
            self._coverage = TiffWindows(open_file(mosaic.coverage), mosaic.name)
            opened.pop_all()

    @property
    def whole(self) -> Window:
        return Window(0, 0, self._image.width_px, self._image.height_px)

    def picture(self, window: Window, size: tuple[int, int]) -> Pixels:
        """(height, width, 3) RGB of a window at `size` (width, height), hatched where no photo covers it."""
        rgb = _reduced(self._image, window, size)
        covered = _reduced(self._coverage, window, size)
        covered = covered if covered.ndim == 2 else covered[..., 0]
        blank = covered < 128
        if blank.any():
            rgb[blank] = _hatch(size)[blank]
        return rgb

    def close(self) -> None:
        self._image.close()
        self._coverage.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _reduced(source: TiffWindows, window: Window, size: tuple[int, int]) -> npt.NDArray[Any]:
    """Area means, band by band: first over whole source pixels, then to the exact size."""
    width, height = size
    step = max(1, min(window.width_px // width, window.height_px // height) // 2)
    band = max(step, BAND_PX // max(1, window.width_px) // step * step)
    parts = []
    for y0 in range(window.y0, window.y1, band):
        part = source.read(y0, min(y0 + band, window.y1), window.x0, window.x1)
        if step > 1:
            coarse = (max(1, part.shape[1] // step), max(1, part.shape[0] // step))
            part = cv2.resize(part, coarse, interpolation=cv2.INTER_AREA)
        parts.append(part)
    return np.asarray(cv2.resize(np.concatenate(parts), size, interpolation=cv2.INTER_AREA))


def reduced_mask(mask: BitMask, window: Window, size: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """(height, width) of a window: set where any pixel under it is, so that the thinnest crack stays in
    sight."""
    width, height = (min(size[0], window.width_px), min(size[1], window.height_px))
    rows = window.y0 + np.arange(height + 1) * window.height_px // height
    columns = np.arange(width) * window.width_px // width
    any_in_rows = (mask.read(a, b, window.x0, window.x1).any(axis=0) for a, b in pairwise(rows.tolist()))
    return np.stack([np.logical_or.reduceat(row, columns) for row in any_in_rows])


def _hatch(size: tuple[int, int]) -> Pixels:
    x, y = np.arange(size[0]), np.arange(size[1])[:, None]
    on_line = (x + y) % HATCH_PERIOD_PX < HATCH_LINE_PX
    return np.where(on_line[..., None], HATCH[1], HATCH[0]).astype(np.uint8)
