"""The mosaic's pixels, tile by tile: memory holds a few tiles and a few photos, never all."""

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from os import cpu_count
from threading import Lock
from typing import NamedTuple

import cv2
import numba
import numpy as np
import numpy.typing as npt

from tasks.stitching.blending import ALIGN, REACH, MultiBand
from tasks.stitching.canvas import Canvas
from tasks.stitching.gain import Light, gain_table, relit
from tasks.stitching.seams import Labels, Partition, label_window, partition, photo_map
from tasks.stitching.view import Array, View, shrunk

Pixels = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float32]
Box = tuple[int, int, int, int]  # left, right, top and bottom; right and bottom excluded

TILE_PX = 1024
CACHE_BYTES = 400_000_000  # of decoded photos kept for the next tile


@dataclass(frozen=True)
class Tile:
    x: int
    y: int
    rgb: Pixels  # (h, w, 3)
    coverage: Pixels  # (h, w) 255 where a photo covers the pixel
    source: npt.NDArray[np.uint16]  # (h, w) 1 + index of the photo; 0: none


class Sizes(NamedTuple):
    """A photo's pixels, and at half its size."""

    full: Pixels
    half: Pixels

    @property
    def nbytes(self) -> int:
        return self.full.nbytes + self.half.nbytes


class PhotoCache:
    """Photos as RGB; the least lately used go first. Threads may share it: one reads, the others wait."""

    def __init__(self, read: Callable[[int], Sizes]) -> None:
        self._read, self._kept, self._lock = read, OrderedDict[int, Future[Sizes]](), Lock()

    def __call__(self, index: int) -> Sizes:
        with self._lock:
            first = index not in self._kept
            photo = self._kept.setdefault(index, Future())
            self._kept.move_to_end(index)
        if first:
            try:
                photo.set_result(self._read(index))
            except BaseException as problem:
                photo.set_exception(problem)
                raise
            self._forget()
        return photo.result()

    def _forget(self) -> None:
        with self._lock:
            there = {i: one.result().nbytes for i, one in self._kept.items() if one.done()}
            while len(there) > 1 and sum(there.values()) > CACHE_BYTES:
                oldest = next(iter(there))
                del there[oldest], self._kept[oldest]


@dataclass(frozen=True)
class Source:
    """A photo as it is used, and what brings it to the light of all."""

    view: View
    half: View
    table: Floats  # (256, 3), as gain_table gives it for each colour
    falloff: Array  # (TERMS,)

    def layer(self, pixels: Pixels, canvas: Canvas, view: View, x: int, y: int, w: int, h: int) -> Floats:
        """(h, w, 3) sRGB levels of a window of the canvas. pixels: the photo's, as large as in `view`."""
        at = photo_map(view, canvas, x, y, w, h)
        warped = cv2.remap(pixels, at, None, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload]
        return relit(np.asarray(warped, np.uint8), at, view, self.table, self.falloff)


def composite(
    canvas: Canvas,
    views: Sequence[View],
    worth: Sequence[float],
    light: Light,
    dark: Sequence[npt.NDArray[np.float32]],
    read: Callable[[int], Pixels],
    on_progress: Callable[[float], None],
) -> Iterator[Tile]:
    """Tiles of TILE_PX, row by row, boustrophedon. `read(i)` gives the photo of views[i] as RGB; `dark`:
    the photos' darkness, for the seams."""
    parted = partition(views, worth, canvas, dark)
    shrink = [max(1, int(canvas.gsd / v.units_per_px + 0.25)) for v in views]
    sources = [
        Source(
            shrunk(view, s),
            shrunk(view, 2 * s),
            np.stack([gain_table(float(g)) for g in gains], axis=1),
            falloff,
        )
        for view, s, gains, falloff in zip(views, shrink, light.gains, light.falloff, strict=True)
    ]

    def read_sizes(index: int) -> Sizes:
        full = _reduced(read(index), sources[index].view)
        return Sizes(full, _reduced(full, sources[index].half))

    cache = PhotoCache(read_sizes)
    corners = _corners(canvas)
    workers = min(2, cpu_count() or 1)
    with ThreadPoolExecutor(max_workers=workers) as threads:
        for start in range(0, len(corners), workers):
            batch = corners[start : start + workers]
            yield from threads.map(lambda corner: _tile(corner, canvas, sources, worth, parted, cache), batch)
            on_progress(min(1.0, (start + workers) / len(corners)))


def _corners(canvas: Canvas) -> list[tuple[int, int]]:
    columns = list(range(0, canvas.width_px, TILE_PX))
    rows = range(0, canvas.height_px, TILE_PX)
    return [(x, y) for k, y in enumerate(rows) for x in (columns if k % 2 == 0 else columns[::-1])]


def _reduced(pixels: Pixels, view: View) -> Pixels:
    """The photo as large as the view has it."""
    size = view.camera.width_px, view.camera.height_px
    if size == pixels.shape[1::-1]:
        return pixels
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)


def _tile(
    corner: tuple[int, int],
    canvas: Canvas,
    sources: Sequence[Source],
    worth: Sequence[float],
    parted: Partition,
    read: Callable[[int], Sizes],
) -> Tile:
    x, y = corner
    width, height = min(TILE_PX, canvas.width_px - x), min(TILE_PX, canvas.height_px - y)
    # The window reaches beyond the tile by what blending sees, beyond the canvas too.
    wx, wy, side = x - REACH, y - REACH, TILE_PX + 2 * REACH
    label = label_window([s.view for s in sources], worth, canvas, parted, wx, wy, side, side)
    own = label[REACH : REACH + height, REACH : REACH + width]
    blend, alone = MultiBand(side, side, REACH), dict(_boxes(own))
    coarse = replace(canvas, gsd=2.0 * canvas.gsd)  # whose pixels are every second of the canvas's
    for i, box in _boxes(label):
        source, pixels = sources[i], read(i)
        x0, x1, y0, y1 = _reached(box, side)
        left, top = (wx + x0) // 2, (wy + y0) // 2
        half = source.layer(pixels.half, coarse, source.half, left, top, (x1 - x0) // 2, (y1 - y0) // 2)
        blend.add(half, (label[y0:y1, x0:x1] == i).astype(np.float32), x0, y0)
        if i in alone:
            a0, a1, b0, b1 = _aligned(alone[i])
            layer = source.layer(pixels.full, canvas, source.view, x + a0, y + b0, a1 - a0, b1 - b0)
            rows, columns = slice(b0 + REACH, b1 + REACH), slice(a0 + REACH, a1 + REACH)
            blend.add_finest(layer, _around(half, rows, columns, x0, y0), label[rows, columns] == i, a0, b0)
    covered = own >= 0
    rgb = np.ascontiguousarray(blend.result()[:height, :width])
    if not covered.all():
        rgb[~covered] = 0
    return Tile(x, y, rgb, np.where(covered, 255, 0).astype(np.uint8), (own + 1).astype(np.uint16))


def _around(half: Floats, rows: slice, columns: slice, x0: int, y0: int) -> Floats:
    """Of a layer at half its size, that starts at x0, y0 of the window, these and two pixels more."""
    top, bottom = (rows.start - y0) // 2 - 2, (rows.stop - y0) // 2 + 2
    left, right = (columns.start - x0) // 2 - 2, (columns.stop - x0) // 2 + 2
    return half[top:bottom, left:right]


def _boxes(label: Labels) -> Iterator[tuple[int, Box]]:
    """Every photo in sight, and the box of its land."""
    for i, (left, right, top, bottom) in enumerate(_extents(label, int(label.max()) + 1).tolist()):
        if right > 0:
            yield i, (left, right, top, bottom)


@numba.njit(cache=True, nogil=True)
def _extents(label: Labels, photos: int) -> Labels:
    """(photos, 4); right is 0 where a photo has no land."""
    boxes = np.empty((photos, 4), np.int32)
    boxes[:, 0], boxes[:, 1], boxes[:, 2], boxes[:, 3] = label.shape[1], 0, label.shape[0], 0
    for y in range(label.shape[0]):
        x = 0
        while x < label.shape[1]:
            own, first = label[y, x], x
            while x < label.shape[1] and label[y, x] == own:
                x += 1
            if own >= 0:
                box = boxes[own]
                box[0], box[1] = min(box[0], first), max(box[1], x)
                box[2], box[3] = min(box[2], y), max(box[3], y + 1)
    return boxes


def _reached(box: Box, side: int) -> Box:
    """Grown by the reach of blending, aligned, inside the window."""
    left, right, top, bottom = box
    low = [max(0, (n - REACH) // ALIGN * ALIGN) for n in (left, top)]
    high = [min(side, -(-(n + REACH) // ALIGN) * ALIGN) for n in (right, bottom)]
    return low[0], high[0], low[1], high[1]


def _aligned(box: Box) -> Box:
    """Grown to multiples of ALIGN: where a projection is exact is the same in every tile."""
    left, right, top, bottom = box
    low = [n // ALIGN * ALIGN for n in (left, top)]
    high = [-(-n // ALIGN) * ALIGN for n in (right, bottom)]
    return low[0], high[0], low[1], high[1]
