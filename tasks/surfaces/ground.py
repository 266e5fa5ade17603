"""Which surfaces are the ground: it bounds the flight but is nothing to inspect by default."""

from collections.abc import Sequence
from itertools import compress

import numpy as np

from schemas.surface import Surface
from tasks.surfaces.boxes import Box, Sorted
from tasks.surfaces.cloud import Floats
from tasks.surfaces.frame import Frame
from tasks.surfaces.naming import LEVEL_DEG
from tasks.surfaces.patches import Patch

AROUND_M = 1.0
LOWER_M = 0.3  # a kerb is still ground
SCRAP = 0.01  # of the largest piece of ground
LOWER_SHARE = 0.02  # of the points around; a ditch or a few stray points below do not matter


def is_ground(surfaces: Sequence[Surface], points_m: Floats) -> list[bool]:
    """True for a level surface, seen from above, with nothing scanned below it within a metre around.

    A deck has the river or its own soffit below, a table the floor beside it. points_m: (N, 3).
    """
    around = Sorted(points_m)
    return [_upward(s) and _lower_share(s, around) < LOWER_SHARE for s in surfaces]


def without_scraps(found: Sequence[Patch], ground: Sequence[bool]) -> tuple[list[Patch], list[bool]]:
    """Without the small pieces of ground that a thinning scan leaves far out: no one inspects them."""
    areas_m2 = [patch.surface.area_m2 for patch in found]
    largest_m2 = max((area for area, is_floor in zip(areas_m2, ground, strict=True) if is_floor), default=0.0)
    kept = [
        not is_floor or area >= SCRAP * largest_m2 for area, is_floor in zip(areas_m2, ground, strict=True)
    ]
    return list(compress(found, kept)), list(compress(ground, kept))


def _upward(surface: Surface) -> bool:
    return surface.plane.normal[2] > float(np.cos(np.radians(LEVEL_DEG)))


def _lower_share(surface: Surface, around: Sorted) -> float:
    frame = Frame.of(surface)
    deepest_m = float(np.ptp(around.points_m[:, 2]))
    aside_m = np.sqrt(2) * AROUND_M + deepest_m * np.tan(np.radians(LEVEL_DEG))  # not quite level
    column = Box.of(frame.world_m(np.asarray(surface.outline_m))).grown(np.array([aside_m, aside_m, np.inf]))
    uvw_m = frame.uvw_m(around.points_m[around.at(column)])
    u_min, v_min, u_max, v_max = surface.bounds_m
    near = (uvw_m[:, 0] > u_min - AROUND_M) & (uvw_m[:, 0] < u_max + AROUND_M)
    near &= (uvw_m[:, 1] > v_min - AROUND_M) & (uvw_m[:, 1] < v_max + AROUND_M)
    return float((uvw_m[near, 2] < -LOWER_M).mean()) if near.any() else 0.0
