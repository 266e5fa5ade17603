"""A parallel view of the world with exact depth: surfaces hide what is behind them, pixel by pixel."""

from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

from artifacts.palette import rgb

Array = npt.NDArray[np.float64]
Pixel = npt.NDArray[np.intp]
SUBPIXELS = 4  # fractional bits of the polygon filler
BEHIND = 0.35  # strength of what shows through from behind a surface


class View:
    """Looks from `azimuth_deg` (clockwise from north, where the viewer stands) down by `elevation_deg`.

    Pixel x to the right, y down, depth in metres away from the viewer; `points_m` (N, 3) all fit in."""

    def __init__(
        self, points_m: npt.ArrayLike, azimuth_deg: float, elevation_deg: float, width_px: int, height_px: int
    ) -> None:
        a, e = np.radians([azimuth_deg, elevation_deg])
        to_viewer = np.array([np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), np.sin(e)])
        right = np.array([-np.cos(a), np.sin(a), 0.0])
        self.axes = np.array([right, -np.cross(to_viewer, right), -to_viewer])  # rows: x, y, depth
        self.width_px, self.height_px = width_px, height_px
        seen = np.asarray(points_m, dtype=float).reshape(-1, 3) @ self.axes.T
        low, high = (seen.min(axis=0), seen.max(axis=0)) if len(seen) else (-np.ones(3), np.ones(3))
        span = np.maximum(high - low, 1e-6)
        self.px_per_m = float(min(0.9 * width_px / span[0], 0.86 * height_px / span[1]))
        self._shift = np.array([width_px, height_px]) / 2 - (low + high)[:2] / 2 * self.px_per_m

    @property
    def to_viewer(self) -> Array:
        return np.asarray(-self.axes[2])

    def project(self, points_m: npt.ArrayLike) -> Array:
        """(N, 3) of (N, 3) world points: x, y in pixels, depth in metres."""
        seen = np.asarray(points_m, dtype=float).reshape(-1, 3) @ self.axes.T
        seen[:, :2] = seen[:, :2] * self.px_per_m + self._shift
        return np.asarray(seen)


class Canvas:
    """Pixels and their depth. Draw what is solid first, then lines and points, which know what hides them."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.pixels = np.full((view.height_px, view.width_px, 3), 255, dtype=np.uint8)
        self.depth_m = np.full((view.height_px, view.width_px), np.inf)

    def polygon(self, rings_m: Sequence[npt.ArrayLike], colour: npt.ArrayLike) -> None:
        """A flat polygon: its outer ring and its holes, each (N, 3)."""
        rings = [self.view.project(ring) for ring in rings_m]
        corners = np.vstack(rings)
        x0, y0 = np.clip(np.floor(corners[:, :2].min(axis=0)).astype(int) - 1, 0, None)
        x1 = min(int(corners[:, 0].max()) + 2, self.view.width_px)
        y1 = min(int(corners[:, 1].max()) + 2, self.view.height_px)
        affine, *_ = np.linalg.lstsq(np.column_stack([corners[:, :2], np.ones(len(corners))]), corners[:, 2])
        if x0 >= x1 or y0 >= y1 or _is_edge_on(corners):
            return
        inside = np.zeros((y1 - y0, x1 - x0), dtype=np.uint8)
        fixed = [np.round((r[:, :2] - (x0, y0)) * 2**SUBPIXELS).astype(np.int32) for r in rings]
        cv2.fillPoly(inside, fixed, 1, shift=SUBPIXELS)
        depth = affine[0] * np.arange(x0, x1) + affine[1] * np.arange(y0, y1)[:, None] + affine[2]
        shown = (inside > 0) & (depth < self.depth_m[y0:y1, x0:x1])
        self.depth_m[y0:y1, x0:x1][shown] = depth[shown]
        self.pixels[y0:y1, x0:x1][shown] = np.asarray(colour, dtype=np.uint8)

    def points(self, points_m: npt.ArrayLike, colours: npt.NDArray[np.uint8], size_px: int = 1) -> None:
        """Squares of a cloud, the nearest on top. colours: (N, 3)."""
        seen = self.view.project(points_m)
        far_first = np.argsort(-seen[:, 2], kind="stable")
        x, y = np.round(seen[far_first, :2]).astype(int).T
        for dy in range(size_px):
            for dx in range(size_px):
                inside = (x + dx >= 0) & (x + dx < self.view.width_px)
                inside &= (y + dy >= 0) & (y + dy < self.view.height_px)
                rows, columns, which = y[inside] + dy, x[inside] + dx, far_first[inside]
                nearer = seen[which, 2] < self.depth_m[rows, columns]
                self.pixels[rows[nearer], columns[nearer]] = colours[which[nearer]]
                # of equal pixels the last assignment, the nearest point's, stays
                self.depth_m[rows[nearer], columns[nearer]] = seen[which[nearer], 2]

    def line(
        self,
        points_m: npt.ArrayLike,
        colour: str,
        width_px: int,
        lift_m: float = 0.02,
        behind: float = BEHIND,
    ) -> None:
        """A polyline; where something hides it, it shows through with strength `behind`. lift_m: a line this
        close behind a surface counts as on it."""
        seen = self.view.project(points_m)
        steps = [self._along(a, b) for a, b in pairwise(seen)]
        if not steps:
            return
        dots = np.vstack(steps)
        x, y = np.round(dots[:, :2]).astype(int).T
        inside = (x >= 0) & (x < self.view.width_px) & (y >= 0) & (y < self.view.height_px)
        visible = np.zeros(len(dots), dtype=bool)
        visible[inside] = dots[inside, 2] - lift_m <= self.depth_m[y[inside], x[inside]]
        for strength, which in ((behind, inside & ~visible), (1.0, inside & visible)):
            self._stamp(x[which], y[which], width_px / 2, colour, strength)

    def discs(self, points_m: npt.ArrayLike, colour: str, radius_px: int, lift_m: float = 0.02) -> None:
        """Filled circles about points; those behind something show through faintly."""
        seen = self.view.project(points_m)
        x, y = np.round(seen[:, :2]).astype(int).T
        inside = (x >= 0) & (x < self.view.width_px) & (y >= 0) & (y < self.view.height_px)
        x, y, depth = x[inside], y[inside], seen[inside, 2]
        hidden = depth - lift_m > self.depth_m[y, x]
        for strength, which in ((BEHIND, hidden), (1.0, ~hidden)):
            self._stamp(x[which], y[which], radius_px, colour, strength)

    def _stamp(self, x: Pixel, y: Pixel, radius_px: float, colour: str, strength: float) -> None:
        """Mix a colour in about these pixels, once wherever they overlap."""
        if not len(x):
            return
        margin = int(radius_px) + 1
        x0, y0 = max(0, int(x.min()) - margin), max(0, int(y.min()) - margin)
        stroke = np.zeros((int(y.max()) + margin + 1 - y0, int(x.max()) + margin + 1 - x0), dtype=np.uint8)
        stroke[y - y0, x - x0] = 255
        side = max(1, round(2 * radius_px))
        if side > 1:
            disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
            stroke = np.asarray(cv2.dilate(stroke, disc), dtype=np.uint8)
        part = self.pixels[y0 : y0 + stroke.shape[0], x0 : x0 + stroke.shape[1]]
        where = stroke[: part.shape[0], : part.shape[1]] > 0
        mixed = (1 - strength) * part[where] + strength * rgb(colour)
        part[where] = np.round(mixed).astype(np.uint8)

    @staticmethod
    def _along(a: Array, b: Array) -> Array:
        """Points from a to b, at most half a pixel apart."""
        count = int(np.ceil(2 * np.abs(b[:2] - a[:2]).max())) + 1
        return np.asarray(a + (b - a) * np.linspace(0, 1, count + 1)[:, None])


def _is_edge_on(corners: Array) -> bool:
    flat = corners[:, :2] - corners[:, :2].mean(axis=0)
    return bool(np.linalg.svd(flat, compute_uv=False)[-1] < 0.5)


def shaded(colour: str, normal: npt.ArrayLike, to_viewer: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """A face's colour in a light from above and beside the viewer; paler where its back is seen."""
    n = np.asarray(normal, dtype=float)
    light = np.asarray(to_viewer, dtype=float) + np.array([0.25, -0.1, 0.6])
    facing = float(n @ np.asarray(to_viewer))
    lit = abs(float(n @ light) / float(np.linalg.norm(light)))
    base = rgb(colour).astype(float)
    if facing < 0:
        base = 0.45 * base + 0.55 * 225.0
    return np.round(np.clip(base * (0.72 + 0.34 * lit), 0, 255)).astype(np.uint8)
