"""Marks on a face with sharp edges (cracks, joints, pores, tie holes, painted patterns): shapes, not pixels.

A camera samples them exactly, at any scale. They are kept in a grid of cells, so that a sample meets only
the few shapes near it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Rgb = tuple[float, float, float]

CELL_M = 0.005
REACH_M = 0.004  # a cell also knows the shapes this far outside it: blur reaches over its border
SEGMENT, DISC, BOX = 0, 1, 2
SHAPE = np.dtype([("kind", "i4"), ("paint", "i4"), ("p", "f8", 8), ("rgb", "f8", 3)])
Shapes = npt.NDArray[np.void]


@dataclass(frozen=True)
class Marks:
    """n shapes. `paint` 0 multiplies what lies below by rgb, 1 covers it with the colour rgb.

    SEGMENT p = u0, v0, u1, v1, left0, right0, left1, right1 (edges' distances from the line, metres);
    DISC p = u, v, radius; BOX p = u, v, cos, sin, half width, half height.
    Cell (column, row) holds items[start[c]:start[c + 1]], c = row · columns + column.
    """

    kind: npt.NDArray[np.int32]  # (n,)
    paint: npt.NDArray[np.int32]  # (n,)
    p: Array  # (n, 8)
    rgb: Array  # (n, 3)
    columns: int
    rows: int
    start: npt.NDArray[np.int32]
    items: npt.NDArray[np.int32]


def segments(uv_m: Array, left_m: Array, right_m: Array, factor: Array) -> Shapes:
    """A line of changing width: (N, 2) points, (N,) distances of its edges, (N,) share of light it keeps."""
    shapes = np.zeros(len(uv_m) - 1, SHAPE)
    shapes["kind"] = SEGMENT
    edges = np.column_stack([left_m[:-1], right_m[:-1], left_m[1:], right_m[1:]])
    shapes["p"] = np.column_stack([uv_m[:-1], uv_m[1:], edges])
    shapes["rgb"] = ((factor[:-1] + factor[1:]) / 2)[:, None]
    return shapes


def line(start_m: npt.ArrayLike, end_m: npt.ArrayLike, width_m: float, factor: float) -> Shapes:
    ends = np.array([start_m, end_m], dtype=float)
    half = np.full(2, width_m / 2)
    return segments(ends, half, half, np.full(2, factor))


def discs(uv_m: Array, radius_m: Array, factor: Array) -> Shapes:
    shapes = np.zeros(len(uv_m), SHAPE)
    shapes["kind"] = DISC
    shapes["p"][:, :2] = uv_m
    shapes["p"][:, 2] = radius_m
    shapes["rgb"] = factor[:, None]
    return shapes


def painted_box(centre_m: npt.ArrayLike, angle_deg: float, size_m: tuple[float, float], rgb: Rgb) -> Shapes:
    shapes = np.zeros(1, SHAPE)
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    u, v = np.asarray(centre_m, dtype=float)
    shapes["kind"], shapes["paint"] = BOX, 1
    shapes["p"][0, :6] = u, v, c, s, size_m[0] / 2, size_m[1] / 2
    shapes["rgb"] = rgb
    return shapes


def painted_disc(centre_m: npt.ArrayLike, radius_m: float, rgb: Rgb) -> Shapes:
    shapes = discs(np.asarray([centre_m], dtype=float), np.array([radius_m]), np.ones(1))
    shapes["paint"], shapes["rgb"] = 1, rgb
    return shapes


def in_cells(shapes: Sequence[Shapes], width_m: float, height_m: float) -> Marks:
    """Sort the shapes of a face of this size into its cells."""
    every = np.concatenate([np.zeros(0, SHAPE), *shapes])
    columns, rows = int(np.ceil(width_m / CELL_M)) + 1, int(np.ceil(height_m / CELL_M)) + 1
    cells, owners = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for index, shape in enumerate(every):
        inside = _cells_of(shape, columns, rows)
        cells.append(inside)
        owners.append(np.full(len(inside), index))
    cell, owner = np.concatenate(cells), np.concatenate(owners)
    order = np.lexsort([owner, cell])
    start = np.searchsorted(cell[order], np.arange(columns * rows + 1))
    kind, paint, p, rgb = (np.ascontiguousarray(every[name]) for name in ("kind", "paint", "p", "rgb"))
    items = owner[order].astype(np.int32)
    return Marks(kind, paint, p, rgb, columns, rows, start.astype(np.int32), items)


def _cells_of(shape: np.void, columns: int, rows: int) -> npt.NDArray[np.int64]:
    p = shape["p"]
    if shape["kind"] == SEGMENT:
        low, high = np.minimum(p[:2], p[2:4]), np.maximum(p[:2], p[2:4])
        thick = p[4:].max()
    elif shape["kind"] == DISC:
        low = high = p[:2]
        thick = p[2]
    else:
        low = high = p[:2]
        thick = np.hypot(p[4], p[5])
    reach = thick + REACH_M
    c0, r0 = np.maximum(np.floor((low - reach) / CELL_M).astype(int), 0)
    c1, r1 = np.minimum(np.floor((high + reach) / CELL_M).astype(int), (columns - 1, rows - 1))
    rows_of, columns_of = np.meshgrid(np.arange(r0, r1 + 1), np.arange(c0, c1 + 1), indexing="ij")
    row, column = rows_of.ravel(), columns_of.ravel()
    if shape["kind"] == SEGMENT and len(row) > 4:  # a long slanted line: only the cells it passes
        centres = (np.column_stack([column, row]) + 0.5) * CELL_M
        along = p[2:4] - p[:2]
        t = np.clip((centres - p[:2]) @ along / max(along @ along, 1e-18), 0, 1)
        near = np.linalg.norm(centres - p[:2] - t[:, None] * along, axis=1) < reach + CELL_M * 0.71
        row, column = row[near], column[near]
    return np.asarray(row * columns + column)
