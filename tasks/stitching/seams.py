"""Which photo each pixel of the mosaic comes from: the one that sees it deepest inside its frame."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from tasks.stitching.canvas import Canvas
from tasks.stitching.view import View

Map = npt.NDArray[np.float32]  # (h, w, 2) photo pixel of each mosaic pixel

GRID_PX = 8  # projections are exact on this grid and linear between: off by less than 0.01 px
OUTSIDE = -1e6  # in a map: the surface is behind the camera there


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


def label_window(
    views: Sequence[View],
    worth: Sequence[float],
    canvas: Canvas,
    x0: int,
    y0: int,
    width: int,
    height: int,
) -> npt.NDArray[np.int32]:
    """(h, w) index into `views` of the photo each pixel comes from; −1 where none sees it.

    A photo counts by its pixels' distance from the frame's border, times its `worth`, times how squarely it
    looks: of two that see a point alike deep inside their frames, the finer and less slanted wins."""
    best = np.zeros((height, width), np.float32)
    label = np.full((height, width), -1, np.int32)
    for i, view in enumerate(views):
        bx0, by0, bx1, by1 = canvas.bounds_px(view)
        ax0, ay0, ax1, ay1 = max(bx0, x0), max(by0, y0), min(bx1, x0 + width), min(by1, y0 + height)
        if ax0 >= ax1 or ay0 >= ay1:
            continue
        at = photo_map(view, canvas, ax0, ay0, ax1 - ax0, ay1 - ay0)
        right, bottom = view.camera.width_px - 1, view.camera.height_px - 1
        x, y = at[..., 0], at[..., 1]
        inside = np.minimum(np.minimum(x, right - x), np.minimum(y, bottom - y))
        depth = (inside + np.float32(1e-3)) * np.float32(worth[i] * -view.R[2, 2])
        window = (slice(ay0 - y0, ay1 - y0), slice(ax0 - x0, ax1 - x0))
        better = depth > best[window]
        best[window][better] = depth[better]
        label[window][better] = i
    return label
