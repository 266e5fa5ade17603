"""A plane cut through a tree is no surface.

On a surface the points end at the inlier distance; in foliage as many again lie just beyond it. Points of
other planes do not count: the other face of a thin plate may be that near.
"""

import numpy as np
import shapely

from tasks.surfaces.boxes import Box, Sorted
from tasks.surfaces.cloud import Floats, Mask
from tasks.surfaces.frame import Frame
from tasks.surfaces.patches import Patch

MOST_BEYOND = 0.5  # points beyond per point within; foliage has about 2, a surface with 1 cm noise 0.1


def in_clutter(patches: list[Patch], points_m: Floats, distance_m: float) -> list[bool]:
    """For each patch whether many points of no plane lie within 3 · distance_m of its plane.

    points_m: (N, 3) the whole cloud, which the patches index.
    """
    free: Mask = np.ones(len(points_m), dtype=bool)
    for patch in patches:
        free[patch.points] = False
    left = Sorted(points_m[free])
    found = []
    for patch in patches:
        frame = Frame.of(patch.surface)
        reach = Box.of(frame.world_m(np.asarray(patch.surface.outline_m))).grown(3 * distance_m)
        uvw_m = frame.uvw_m(left.points_m[left.at(reach)])
        height_m = np.abs(uvw_m[:, 2])
        beyond = uvw_m[(height_m > distance_m) & (height_m <= 3 * distance_m)]
        outline = shapely.Polygon(patch.surface.outline_m, patch.surface.holes_m)
        shapely.prepare(outline)
        count = int(shapely.contains_xy(outline, beyond[:, 0], beyond[:, 1]).sum())
        found.append(count > MOST_BEYOND * patch.surface.points)
    return found
