"""Heights of a surface over its plane, as the cameras above it need them."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

ITERATIONS = 8  # of meeting a ray with the relief: it is low and gentle against the ray


@dataclass(frozen=True, eq=False)
class HeightMap:
    """(rows, columns) heights w; (r, c) lies at u = left + c·cell, v = bottom + r·cell; linear between,
    beyond the grid as at its rim. Plane units."""

    w: Array
    left: float
    bottom: float
    cell: float

    def at(self, uv: Array) -> Array:
        """(N,) heights over (N, 2)."""
        (a, b, c, d), x, y = self._corners(uv)
        return np.asarray((a + x * (b - a)) * (1 - y) + (c + x * (d - c)) * y)

    def slope(self, uv: Array) -> Array:
        """(N, 2) how they rise along u and v."""
        (a, b, c, d), x, y = self._corners(uv)
        along = np.column_stack([(b - a) * (1 - y) + (d - c) * y, (c - a) * (1 - x) + (d - b) * x])
        return np.asarray(along / self.cell)

    def seen_by(self, outlines_uv: Sequence[Array]) -> npt.NDArray[np.bool_]:
        """(rows, columns) which points of the grid lie in one of the outlines, (N, 2) each."""
        seen = np.zeros(self.w.shape, np.uint8)
        for outline in outlines_uv:
            at = np.rint((outline - [self.left, self.bottom]) / self.cell).astype(np.int32)
            cv2.fillConvexPoly(seen, at, 1)
        return seen > 0

    def moved(self, scale: float, angle_rad: float, shift: Array) -> "HeightMap":
        """Under the similarity q → scale · rotation · q + shift of the plane, on a grid of its own."""
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        turn, cell = scale * np.array([[c, -s], [s, c]]), scale * self.cell
        rows, columns = self.w.shape
        far = np.array([columns - 1, rows - 1]) * self.cell
        corners = np.array([self.left, self.bottom]) + far * [[0, 0], [1, 0], [0, 1], [1, 1]]
        corners = corners @ turn.T + shift
        low, high = corners.min(axis=0), corners.max(axis=0)
        across, up = (np.arange(np.ceil(n) + 1) * cell for n in (high - low) / cell - 1e-9)
        uv = np.stack(np.meshgrid(low[0] + across, low[1] + up), axis=-1).reshape(-1, 2)
        w = scale * self.at((uv - shift) @ np.linalg.inv(turn).T)
        return HeightMap(w.reshape(len(up), len(across)), float(low[0]), float(low[1]), cell)

    def met(self, uv: Array, C: Array) -> Array:
        """(N, 2) over which the rays from C to the plane's (N, 2) points meet the relief; NaN stays."""
        met = uv
        for _ in range(ITERATIONS):
            met = uv + (self.at(met) / C[2])[:, None] * (C[:2] - uv)
        return np.asarray(met)

    def _corners(self, uv: Array) -> tuple[tuple[Array, Array, Array, Array], Array, Array]:
        """Heights of the cell's four corners around each point, and where it lies in the cell, 0..1."""
        rows, columns = self.w.shape
        x = np.clip(np.nan_to_num((uv[:, 0] - self.left) / self.cell), 0, columns - 1.000001)
        y = np.clip(np.nan_to_num((uv[:, 1] - self.bottom) / self.cell), 0, rows - 1.000001)
        c, r = x.astype(np.int64), y.astype(np.int64)
        first = r * columns + c
        w = self.w.ravel()
        return (w[first], w[first + 1], w[first + columns], w[first + columns + 1]), x - c, y - r
