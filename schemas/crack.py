"""A crack, measured."""

import math
from itertools import pairwise
from typing import Literal

from schemas.contract import Contract, Vector2, Vector3


class WidthSample(Contract):
    s_mm: float  # along the centreline from its first point
    width_mm: float
    sigma_mm: float


class Crack(Contract):
    """Lengths are NaN-free: a crack of a mosaic without scale carries only the pixel fields."""

    id: str  # "<surface>-C001", by position, the same in every run
    surface: str
    polyline_px: tuple[Vector2, ...]  # centreline in the mosaic (or image), x right, y down
    length_px: float
    width_median_px: float
    width_max_px: float
    orientation_deg: float  # of its main axis: 0 along +u (right), counter-clockwise, in [0, 180)
    length_mm: float | None = None
    length_sigma_mm: float | None = None
    width_median_mm: float | None = None
    width_max_mm: float | None = None  # 95th percentile of the profile: one chipped edge is no width
    width_sigma_mm: float | None = None
    width_is_upper_bound: bool = False  # too narrow for its blur: only "at most" can be said
    widths: tuple[WidthSample, ...] = ()
    polyline_world_m: tuple[Vector3, ...] = ()
    position_m: Vector3 | None = None  # middle of the centreline in the world
    position_uv_m: Vector2 | None = None  # and in the surface's frame
    photo: str | None = None  # the photo that its pixels come from
    network: int = 0  # cracks of one surface that are joined (branches) share it
    kind: Literal["longitudinal", "transverse", "diagonal", "map"] | None = None
    severity: Literal["hairline", "fine", "medium", "wide"] | None = None

    @property
    def middle_px(self) -> Vector2 | None:
        """Half-way along the centreline; its vertices lie where it bends, not evenly. None without one."""
        if not self.polyline_px:
            return None
        left_px = sum(map(math.dist, self.polyline_px, self.polyline_px[1:])) / 2
        for (x0, y0), (x1, y1) in pairwise(self.polyline_px):
            step_px = math.hypot(x1 - x0, y1 - y0)
            if step_px >= left_px and step_px > 0:
                share = left_px / step_px
                return x0 + share * (x1 - x0), y0 + share * (y1 - y0)
            left_px -= step_px
        return self.polyline_px[-1]


class Measurement(Contract):
    """The cracks of one mosaic or image, and what was looked at but is no crack."""

    surface: str
    cracks: tuple[Crack, ...]
    psf_px: float = 0.8  # σ of the image's blur that the widths were measured with
    rejected: tuple[tuple[Vector2, str], ...] = ()  # position in pixels, and why it is no crack
