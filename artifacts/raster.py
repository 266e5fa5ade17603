"""Windows of mosaics on disk: tiled TIFF, 8-bit RGB or one channel, decoded tile by tile."""

import math
import os
from contextlib import ExitStack, closing
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import cv2
import numpy as np
import numpy.typing as npt
import tifffile

from artifacts.mask_png import read_mask
from schemas.problem import BadInput
from schemas.raster import Pixels

REMEDY = "Stitch this surface again"
MOST_LEVELS = 16  # that somebody draws: a level for each kind of crack


class TiffWindows:
    """Reads any window of a tiled (or striped) TIFF. Safe to use from several threads.

    remedy: what to do where it cannot be read."""

    def __init__(self, path: Path, name: str, remedy: str = REMEDY) -> None:
        self._name, self._remedy = name, remedy
        with ExitStack() as opened:
            try:
                self._file = opened.enter_context(tifffile.TiffFile(path))
                self._page: Any = cast(Any, self._file.pages[0])
                self.height_px, self.width_px = (int(n) for n in self._page.shape[:2])
                self.channels, self.dtype = math.prod(self._page.shape[2:]), np.dtype(self._page.dtype)
                self._rows, self._columns = (int(n) for n in self._page.chunks[:2])
                if self._page.planarconfig != tifffile.PLANARCONFIG.CONTIG:
                    raise ValueError("its colours lie apart, one plane after the other")
            except (OSError, ValueError, IndexError, AttributeError, tifffile.TiffFileError) as error:
                raise BadInput(name, f"its mosaic cannot be read ({error})", remedy) from None
            opened.pop_all()  # nothing went wrong: it stays open until close()
        self._across = -(-self.width_px // self._columns)
        self._descriptor = self._file.filehandle.fileno()

    @property
    def packed_px(self) -> tuple[int, int]:
        """Rows and columns that are packed together."""
        return self._rows, self._columns

    def read(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[Any]:
        """(y1 − y0, x1 − x0[, channels]) of rows y0..y1 and columns x0..x1."""
        shape = (y1 - y0, x1 - x0, *self._page.shape[2:])
        window = np.zeros(shape, dtype=self._page.dtype)
        for i in range(y0 // self._rows, -(-y1 // self._rows)):
            for j in range(x0 // self._columns, -(-x1 // self._columns)):
                top, left = i * self._rows, j * self._columns
                tile = self._tile(i * self._across + j)
                if tile is None:
                    continue  # a sparse tile: nothing was written there
                a, b = max(y0, top), min(y1, top + tile.shape[0])
                c, d = max(x0, left), min(x1, left + tile.shape[1])
                window[a - y0 : b - y0, c - x0 : d - x0] = tile[a - top : b - top, c - left : d - left]
        return window

    def _tile(self, index: int) -> npt.NDArray[Any] | None:
        offset, size = self._page.dataoffsets[index], self._page.databytecounts[index]
        if size == 0:
            return None
        try:
            data = os.pread(self._descriptor, size, offset)
            decoded, _, _ = self._page.decode(data, index, jpegtables=self._page.jpegtables)
        except Exception as error:  # whatever a codec raises over damaged bytes, or where it is missing
            raise BadInput(self._name, f"its mosaic cannot be unpacked ({error})", self._remedy) from None
        tile = decoded[0]
        return np.asarray(tile if len(self._page.shape) == 3 else tile[..., 0])

    def close(self) -> None:
        self._file.close()


class MosaicRaster:
    """A mosaic's pixels, and where it knows them: covered by a photo and not taken out by a mask.

    mask: set where pixels are to be taken out (Patterns.mask); None takes none out."""

    def __init__(self, image: Path, coverage: Path, name: str, mask: Path | None = None) -> None:
        with ExitStack() as opened:
            self._image = opened.enter_context(closing(TiffWindows(image, name)))
            self._coverage = opened.enter_context(closing(TiffWindows(coverage, name)))
            self.height_px, self.width_px = self._image.height_px, self._image.width_px
            self._mask = None if mask is None else read_mask(mask, name)
            sizes = [(self._coverage.height_px, self._coverage.width_px)]
            sizes += [] if self._mask is None else [(self._mask.height_px, self._mask.width_px)]
            if any(size != (self.height_px, self.width_px) for size in sizes):
                raise BadInput(name, "its mosaic and its masks differ in size", REMEDY)
            self._opened = opened.pop_all()  # nothing went wrong: they stay open until close()

    def rgb(self, y0: int, y1: int, x0: int, x1: int) -> Pixels:
        return np.asarray(self._image.read(y0, y1, x0, x1))

    def valid(self, y0: int, y1: int, x0: int, x1: int) -> npt.NDArray[np.bool_]:
        known = self._coverage.read(y0, y1, x0, x1) > 0
        if self._mask is not None:
            known &= ~self._mask.read(y0, y1, x0, x1)
        return known

    def close(self) -> None:
        self._opened.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_drawn_mask(path: Path, name: str) -> npt.NDArray[np.bool_]:
    """(H, W) of a mask that somebody drew, of any image format: True where it is not 0. Where JPEG or
    smoothing have made more levels of the few that were drawn, the edge lies half-way up. Where all of it is
    of one colour, what is drawn is the transparency. BadInput by name."""
    drawn = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if drawn is None:
        raise BadInput(name, "is no image", "Give the mask as PNG, not 0 where there is a crack")
    if drawn.min() == drawn.max():
        stored = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        if stored is not None and stored.ndim == 3 and stored.shape[2] == 4:
            alpha = stored[..., 3]
            transparent = (alpha // 257 if alpha.dtype == np.uint16 else alpha).astype(np.uint8)
            drawn = transparent if alpha.min() < alpha.max() else drawn
    levels = cv2.calcHist([drawn], [0], None, [256], [0, 256])
    blurred = np.count_nonzero(levels) > MOST_LEVELS
    mask: npt.NDArray[np.bool_] = drawn >= (drawn.max() / 2 if blurred else 1)
    if mask.mean() > 0.5:
        share = f"marks {100 * mask.mean():.0f} % of the image as crack"
        raise BadInput(name, share, "Where it is black on white, invert it: cracks are what is not 0")
    return mask
