"""The mosaic's pixels, tile by tile: memory holds a few tiles and a few photos, never all."""

from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count
from threading import Lock

import cv2
import numba
import numpy as np
import numpy.typing as npt

from tasks.stitching.blending import ALIGN, REACH, MultiBand
from tasks.stitching.canvas import Canvas
from tasks.stitching.gain import Light, gain_table, relit
from tasks.stitching.seams import Labels, Partition, label_window, partition, photo_map
from tasks.stitching.view import View, shrunk

Pixels = npt.NDArray[np.uint8]

TILE_PX = 1024
CACHE_BYTES = 400_000_000  # of decoded photos kept for the next tile


@dataclass(frozen=True)
class Tile:
    x: int
    y: int
    rgb: Pixels  # (h, w, 3)
    coverage: Pixels  # (h, w) 255 where a photo covers the pixel
    source: npt.NDArray[np.uint16]  # (h, w) 1 + index of the photo; 0: none


class PhotoCache:
    """Photos as RGB; the least lately used go first. Threads may share it: one reads, the others wait."""

    def __init__(self, read: Callable[[int], Pixels]) -> None:
        self._read, self._kept, self._lock = read, OrderedDict[int, Future[Pixels]](), Lock()

    def __call__(self, index: int) -> Pixels:
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
    used = [shrunk(v, s) for v, s in zip(views, shrink, strict=True)]
    tables = [np.stack([gain_table(float(g)) for g in gains], axis=1) for gains in light.gains]

    def read_used(index: int) -> Pixels:
        pixels, camera = read(index), used[index].camera
        if shrink[index] == 1:
            return pixels
        return np.asarray(
            cv2.resize(pixels, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
        )

    cache = PhotoCache(read_used)
    corners = _corners(canvas)
    workers = min(2, cpu_count() or 1)
    with ThreadPoolExecutor(max_workers=workers) as threads:
        for start in range(0, len(corners), workers):
            batch = corners[start : start + workers]
            yield from threads.map(
                lambda corner: _tile(corner, canvas, used, worth, parted, tables, light, cache), batch
            )
            on_progress(min(1.0, (start + workers) / len(corners)))


def _corners(canvas: Canvas) -> list[tuple[int, int]]:
    columns = list(range(0, canvas.width_px, TILE_PX))
    rows = range(0, canvas.height_px, TILE_PX)
    return [(x, y) for k, y in enumerate(rows) for x in (columns if k % 2 == 0 else columns[::-1])]


def _tile(
    corner: tuple[int, int],
    canvas: Canvas,
    views: Sequence[View],
    worth: Sequence[float],
    parted: Partition,
    tables: Sequence[npt.NDArray[np.float32]],
    light: Light,
    read: Callable[[int], Pixels],
) -> Tile:
    x, y = corner
    width, height = min(TILE_PX, canvas.width_px - x), min(TILE_PX, canvas.height_px - y)
    # The window reaches beyond the tile by what blending sees, beyond the canvas too.
    wx, wy = x - REACH, y - REACH
    ww, wh = TILE_PX + 2 * REACH, TILE_PX + 2 * REACH
    label = label_window(views, worth, canvas, parted, wx, wy, ww, wh)
    blend = MultiBand(ww, wh)
    for i, (left, right, top, bottom) in _boxes(label):
        x0, x1 = _reached(left, right, ww)
        y0, y1 = _reached(top, bottom, wh)
        at = photo_map(views[i], canvas, wx + x0, wy + y0, x1 - x0, y1 - y0)
        warped = cv2.remap(read(i), at[..., 0], at[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        layer = relit(np.asarray(warped, np.uint8), at, views[i], tables[i], light.falloff[i])
        blend.add(layer, (label[y0:y1, x0:x1] == i).astype(np.float32), x0, y0)
    inner = (slice(REACH, REACH + height), slice(REACH, REACH + width))
    own = label[inner]
    covered = own >= 0
    rgb = np.ascontiguousarray(blend.result()[inner])
    if not covered.all():
        rgb[~covered] = 0
    return Tile(x, y, rgb, np.where(covered, 255, 0).astype(np.uint8), (own + 1).astype(np.uint16))


def _boxes(label: Labels) -> Iterator[tuple[int, tuple[int, int, int, int]]]:
    """Every photo in sight, and the left, right, top and bottom of its land; right and bottom excluded."""
    for i, (left, right, top, bottom) in enumerate(_extents(label, int(label.max()) + 1).tolist()):
        if right > 0:
            yield i, (left, right, top, bottom)


@numba.njit(cache=True, nogil=True)
def _extents(label: Labels, photos: int) -> Labels:
    """(photos, 4); right is 0 where a photo has no land."""
    boxes = np.empty((photos, 4), np.int32)
    boxes[:, 0], boxes[:, 1], boxes[:, 2], boxes[:, 3] = label.shape[1], 0, label.shape[0], 0
    for y in range(label.shape[0]):
        for x in range(label.shape[1]):
            if label[y, x] >= 0:
                box = boxes[label[y, x]]
                box[0], box[1] = min(box[0], x), max(box[1], x + 1)
                box[2], box[3] = min(box[2], y), max(box[3], y + 1)
    return boxes


def _reached(low: int, high: int, size: int) -> tuple[int, int]:
    """Grown by the reach of blending, aligned."""
    return max(0, (low - REACH) // ALIGN * ALIGN), min(size, -(-(high + REACH) // ALIGN) * ALIGN)
