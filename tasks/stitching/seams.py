"""Which photo each pixel of the mosaic comes from: the one that sees it deepest inside its frame, but that no
seam runs along a crack.

Decided for the whole canvas at once, in cells of a few pixels. Where one photo sees a cell much better than
all others, it has it. Between, each photo's land grows from there (a Voronoi partition by travel time,
Dijkstra), and it grows fast along dark lines: two lands meet on a crack head on, across it, and a crack that
lies along the border is taken whole by the land that reaches it first."""

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

import cv2
import numba
import numpy as np
import numpy.typing as npt

from tasks.stitching.canvas import Canvas
from tasks.stitching.view import View

Map = npt.NDArray[np.float32]  # (h, w, 2) photo pixel of each mosaic pixel

GRID_PX = 8  # projections are exact on this grid and linear between: off by less than 0.01 px
OUTSIDE = -1e6  # in a map: the surface is behind the camera there
DARK_PX = 8  # darkest pixels are looked for in squares of so many photo pixels
CELL_PX = 8  # of the canvas; twice as many until there are no more cells than
MOST_CELLS = 2**24
RIVALS = 3  # photos that may have a cell: the best, and those not much worse
SURE = 1.5  # a photo that sees a cell better by this factor than any other has it
MUCH_WORSE = 2.0  # and one that sees it worse by this never does
FASTEST = 100.0  # travel along the darkest lines, against unmarked surface
NONE = -1
DIAGONAL = 2**0.5

Labels = npt.NDArray[np.int32]


def photo_map(view: View, canvas: Canvas, x0: int, y0: int, width: int, height: int) -> Map:
    """Photo pixels (as taken) of a window of the canvas."""
    columns, rows = -(-width // GRID_PX) + 2, -(-height // GRID_PX) + 2  # one more on each side
    x = x0 + (np.arange(columns) - 1) * GRID_PX + (GRID_PX - 1) / 2  # middles, as cv2.resize has them
    y = y0 + (np.arange(rows) - 1) * GRID_PX + (GRID_PX - 1) / 2
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    with np.errstate(invalid="ignore"):
        photo = np.nan_to_num(view.to_photo(canvas.to_plane(grid)), nan=OUTSIDE)
    coarse = np.clip(photo, OUTSIDE, -OUTSIDE).astype(np.float32).reshape(rows, columns, 2)
    fine = cv2.resize(coarse, (columns * GRID_PX, rows * GRID_PX), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(fine[GRID_PX : GRID_PX + height, GRID_PX : GRID_PX + width])


@dataclass(frozen=True)
class Partition:
    """The photo of each cell; NONE where none shows the whole cell."""

    label: Labels  # (rows, columns)
    cell_px: int

    def window(self, x0: int, y0: int, width: int, height: int) -> Labels:
        """(height, width) of pixels; NONE beyond the canvas."""
        rows, columns = self.label.shape
        y = np.clip(np.floor_divide(np.arange(y0, y0 + height), self.cell_px), -1, rows)
        x = np.clip(np.floor_divide(np.arange(x0, x0 + width), self.cell_px), -1, columns)
        cells = np.full((y[-1] - y[0] + 1, x[-1] - x[0] + 1), NONE, np.int32)
        top, bottom, left, right = max(y[0], 0), min(y[-1] + 1, rows), max(x[0], 0), min(x[-1] + 1, columns)
        cells[top - y[0] : bottom - y[0], left - x[0] : right - x[0]] = self.label[top:bottom, left:right]
        return np.asarray(cells.take(y - y[0], axis=0).take(x - x[0], axis=1))


def darkness(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """(h, w) how far the darkest pixel of each square of DARK_PX lies below the square's mean, as a share of
    it: of a line, its depth, whatever the light."""
    grey = cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)
    height, width = grey.shape[0] // DARK_PX, grey.shape[1] // DARK_PX
    rows = grey[: height * DARK_PX].reshape(height, DARK_PX, -1).min(axis=1)  # along memory: the quick way
    lowest = rows[:, : width * DARK_PX].reshape(height, width, DARK_PX).min(axis=2).astype(np.float32)
    size = (width, height)
    mean = cv2.resize(grey[: height * DARK_PX, : width * DARK_PX], size, interpolation=cv2.INTER_AREA)
    return np.asarray((mean - lowest) / np.maximum(mean, np.float32(1.0)), np.float32)


def partition(
    views: Sequence[View],
    worth: Sequence[float],
    canvas: Canvas,
    dark: Sequence[npt.NDArray[np.float32]],
) -> Partition:
    """A photo counts in a cell by its distance from the frame's border, times its `worth`, times how squarely
    it looks: of two that see it alike deep inside their frames, the finer and less slanted wins. `dark`: each
    photo's darkness."""
    cell = CELL_PX
    while (canvas.width_px // cell + 1) * (canvas.height_px // cell + 1) > MOST_CELLS:
        cell *= 2
    coarse = canvas.in_cells(cell)
    shape = (coarse.height_px, coarse.width_px)
    score = np.zeros((RIVALS, *shape), np.float32)  # falling
    label = np.full((RIVALS, *shape), NONE, np.int32)
    darkest = np.zeros(shape, np.float32)
    for i, view in enumerate(views):
        x0, y0, x1, y1 = coarse.bounds_px(view)
        if x0 >= x1 or y0 >= y1:
            continue
        at = photo_map(view, coarse, x0, y0, x1 - x0, y1 - y0)
        margin = np.float32(0.75 * cell * canvas.gsd / view.units_per_px)  # the whole cell is in the photo
        depth = depth_inside(view, at) - margin
        value = np.where(depth > 0, depth * np.float32(worth[i] * -view.R[2, 2]), 0).astype(np.float32)
        window = (slice(y0, y1), slice(x0, x1))
        there = (at + np.float32(0.5)) * np.float32(1 / DARK_PX) - np.float32(0.5)
        lines = cv2.remap(
            dark[i], there[..., 0], there[..., 1], cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE
        )
        darkest[window] = np.where(value > score[0][window], lines, darkest[window])
        mine = np.full(value.shape, i, np.int32)
        for k in range(RIVALS):  # insert, moving worse ones down
            better = value > score[k][window]
            for kept, new in ((score, value), (label, mine)):
                old = kept[k][window].copy()
                kept[k][window][better] = new[better]
                new[better] = old[better]
    darkest = np.asarray(
        cv2.dilate(darkest, np.ones((3, 3), np.uint8)), np.float32
    )  # seams keep off by a cell
    label[score * np.float32(MUCH_WORSE) < score[0]] = NONE
    seen = label[0] != NONE
    usual = float(np.median(darkest[seen])) if seen.any() else 1.0
    slowness = (usual / np.clip(darkest, usual, None) if usual > 0 else np.ones(shape)) ** 2
    sure = score[0] > np.float32(SURE) * score[1]
    grown = np.where(sure & seen, label[0], np.int32(NONE)).astype(np.int32)
    _grow(grown, label, np.maximum(slowness, 1 / FASTEST).astype(np.float32))
    return Partition(np.where(grown == NONE, label[0], grown).astype(np.int32), cell)


def depth_inside(view: View, at: Map) -> npt.NDArray[np.float32]:
    """Distance of photo pixels from the frame's border; negative outside."""
    right, bottom = np.float32(view.camera.width_px - 1), np.float32(view.camera.height_px - 1)
    x, y = at[..., 0], at[..., 1]
    return np.asarray(np.minimum(np.minimum(x, right - x), np.minimum(y, bottom - y)))


@numba.njit(cache=True)
def _grow(grown: Labels, rivals: Labels, slowness: npt.NDArray[np.float32]) -> None:
    """In place: cells without a photo get that of the neighbour whose land reaches them first, if it is one
    of the cell's rivals. Equal times: the cell that comes first on the canvas."""
    rows, columns = grown.shape
    heap = [(np.float32(0.0), np.int64(0), np.int64(0)) for _ in range(0)]
    for y in range(rows):
        for x in range(columns):
            if grown[y, x] == NONE:
                continue
            for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                v, u = y + dy, x + dx
                if 0 <= v < rows and 0 <= u < columns and grown[v, u] == NONE and rivals[0, v, u] != NONE:
                    heappush(heap, (slowness[v, u], np.int64(v * columns + u), np.int64(grown[y, x])))
    while len(heap) > 0:
        time, place, photo = heappop(heap)  # 64-bit integers, as numba's heap wants them alike
        y, x = place // columns, place % columns
        if grown[y, x] != NONE:
            continue
        allowed = False
        for k in range(rivals.shape[0]):
            allowed = allowed or rivals[k, y, x] == photo
        if not allowed:
            continue
        grown[y, x] = photo
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                v, u = y + dy, x + dx
                if 0 <= v < rows and 0 <= u < columns and grown[v, u] == NONE and rivals[0, v, u] != NONE:
                    step = np.float32(1.0 if dy == 0 or dx == 0 else DIAGONAL)
                    heappush(heap, (time + step * slowness[v, u], np.int64(v * columns + u), photo))


def label_window(
    views: Sequence[View],
    worth: Sequence[float],
    canvas: Canvas,
    parted: Partition,
    x0: int,
    y0: int,
    width: int,
    height: int,
) -> Labels:
    """(h, w) index into `views` of the photo each pixel comes from; NONE where none sees it. As parted;
    where no photo shows a whole cell, along the mosaic's rim, pixel by pixel."""
    label = parted.window(x0, y0, width, height)
    rim = label == NONE
    rx0, ry0, rx1, ry1 = _around(rim, canvas, x0, y0)
    best = np.zeros((height, width), np.float32)
    for i, view in enumerate(views if rx0 < rx1 else ()):
        bx0, by0, bx1, by1 = canvas.bounds_px(view)
        ax0, ay0, ax1, ay1 = max(bx0, rx0), max(by0, ry0), min(bx1, rx1), min(by1, ry1)
        window = (slice(ay0 - y0, ay1 - y0), slice(ax0 - x0, ax1 - x0))
        if ax0 >= ax1 or ay0 >= ay1 or not rim[window].any():
            continue
        inside = depth_inside(view, photo_map(view, canvas, ax0, ay0, ax1 - ax0, ay1 - ay0))
        depth = (inside + np.float32(1e-3)) * np.float32(worth[i] * -view.R[2, 2])
        better = rim[window] & (depth > best[window])
        best[window][better] = depth[better]
        label[window][better] = i
    return label


def _around(rim: npt.NDArray[np.bool_], canvas: Canvas, x0: int, y0: int) -> tuple[int, int, int, int]:
    """The box of the rim's pixels on the canvas, the window's corner at x0, y0: left, top, right, bottom;
    empty where there are none."""
    top, left = max(0, -y0), max(0, -x0)
    on_canvas = rim[top : canvas.height_px - y0, left : canvas.width_px - x0]
    rows, columns = np.flatnonzero(on_canvas.any(axis=1)), np.flatnonzero(on_canvas.any(axis=0))
    if len(rows) == 0:
        return 0, 0, 0, 0
    right, bottom = left + int(columns[-1]) + 1, top + int(rows[-1]) + 1
    return x0 + left + int(columns[0]), y0 + top + int(rows[0]), x0 + right, y0 + bottom
