"""The mosaic's canvas: which part of the plane it shows, at which ground sample distance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from schemas.problem import BadInput
from schemas.surface import Surface
from tasks.stitching.view import Array, View

MARGIN_M = 0.3  # around a surface's outline: poses, and so the mosaic, may lie off by this
LARGEST_SHARE = 30.0  # a canvas of more pixels than so many times all photos' is no mosaic of them
LARGEST_PX = 2**34


@dataclass(frozen=True)
class Canvas:
    """Pixel (x, y) lies at u = left + x·gsd, v = top − y·gsd; in metres, or of no unit without a scale."""

    left: float
    top: float
    gsd: float
    width_px: int
    height_px: int

    @property
    def H_mosaic_plane(self) -> Array:
        g = self.gsd
        return np.array([[1 / g, 0, -self.left / g], [0, -1 / g, self.top / g], [0, 0, 1.0]])

    def to_plane(self, xy: Array) -> Array:
        """(N, 2) plane points of (N, 2) mosaic pixels."""
        return np.column_stack([self.left + xy[:, 0] * self.gsd, self.top - xy[:, 1] * self.gsd])

    def in_cells(self, cell_px: int) -> "Canvas":
        """Whose pixels are cells of so many of this one's, the last ones cut."""
        middle = (cell_px - 1) / 2 * self.gsd
        return Canvas(
            self.left + middle,
            self.top - middle,
            self.gsd * cell_px,
            -(-self.width_px // cell_px),
            -(-self.height_px // cell_px),
        )

    def bounds_px(self, view: View) -> tuple[int, int, int, int]:
        """x0, y0, x1, y1 of the pixels that the photo may cover, cut to the canvas; x1, y1 excluded."""
        outline = view.outline_uv
        low, high = np.nanmin(outline, axis=0), np.nanmax(outline, axis=0)
        x = (np.array([low[0], high[0]]) - self.left) / self.gsd
        y = (self.top - np.array([high[1], low[1]])) / self.gsd
        x0, x1 = np.clip([np.floor(x[0]), np.ceil(x[1]) + 1], 0, self.width_px)
        y0, y1 = np.clip([np.floor(y[0]), np.ceil(y[1]) + 1], 0, self.height_px)
        return int(x0), int(y0), int(x1), int(y1)


def lay_out(name: str, views: Sequence[View], surface: Surface | None, gsd: float | None) -> Canvas:
    """Around all footprints, cut to the surface's bounds and a margin; at the median resolution of the
    photos unless `gsd` (plane units a pixel) is asked for. Raises BadInput where the canvas is absurd."""
    step = float(np.median([v.units_per_px for v in views])) if gsd is None else gsd
    outlines = np.concatenate([v.outline_uv for v in views])
    low, high = np.nanmin(outlines, axis=0), np.nanmax(outlines, axis=0)
    if surface is not None:
        u0, v0, u1, v1 = surface.bounds_m
        low = np.maximum(low, [u0 - MARGIN_M, v0 - MARGIN_M])
        high = np.minimum(high, [u1 + MARGIN_M, v1 + MARGIN_M])
        if (low >= high).any():
            raise BadInput(
                name,
                "no photo shows any part of this surface",
                "Check that the photos' poses and the surface are in the same coordinates",
            )
    left, top = np.floor(low[0] / step) * step, np.ceil(high[1] / step) * step
    width = int(np.ceil((high[0] - left) / step)) + 1
    height = int(np.ceil((top - low[1]) / step)) + 1
    photo_px = [v.camera.width_px * v.camera.height_px * (v.units_per_px / step) ** 2 for v in views]
    if width * height > min(LARGEST_SHARE * sum(photo_px), LARGEST_PX):
        raise BadInput(
            name,
            f"the photos do not add up to a mosaic (it would have {width * height / 1e6:.1f} million pixels)",
            "Check the camera's focal length, the poses and gsd_mm_px, or give the photos more overlap",
        )
    return Canvas(float(left), float(top), step, width, height)
