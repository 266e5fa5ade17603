"""Names that say what a surface is and stay the same in every run.

A surface is called by the way it faces: `wall-south` (within 25° of upright, eight compass directions),
`soffit` (level, seen from below), `top` (level, seen from above), `ground` (the top that all stands on),
`slope-west` (between upright and level). Each group is numbered from back to front along its facing (so
soffits from the highest level down), on one plane from left to right as the viewer sees it, then from bottom
to top. The place along the facing is the one that scans measure to millimetres; places that differ by less
than scanner noise or a shadow's edge count as equal, so that they do not change the order.
"""

from collections.abc import Sequence

import numpy as np
import shapely

from schemas.surface import Surface
from tasks.surfaces.cloud import Floats, Indices
from tasks.surfaces.frame import Frame

LEVEL_DEG = 25.0  # from level or from upright; as schemas.surface.in_plane_axes
COMPASS = ("north", "northeast", "east", "southeast", "south", "southwest", "west", "northwest")
SAME_PLANE_M = 0.07  # above registration error, no usual step
SAME_COLUMN_M = 0.35  # between the middles of surfaces above one another


def name_surfaces(surfaces: Sequence[Surface], ground: Sequence[bool]) -> tuple[Surface, ...]:
    """Named, in the order of their names. ground: which of them are ground (ground.py says)."""
    groups = [_group(s, g) for s, g in zip(surfaces, ground, strict=True)]
    named = []
    for group in sorted(set(groups)):
        members = [s for s, g in zip(surfaces, groups, strict=True) if g == group]
        for number, index in enumerate(_order(members), start=1):
            named.append(members[index].model_copy(update={"name": f"{group}-{number:02d}"}))
    return tuple(named)


def middle_m(surface: Surface) -> Floats:
    """(3,) centroid of the outline less its holes, in the world."""
    centre = shapely.Polygon(surface.outline_m, surface.holes_m).centroid
    return np.asarray(Frame.of(surface).world_m(np.array([[centre.x, centre.y]]))[0])


def _group(surface: Surface, is_ground: bool) -> str:
    east, north, up = surface.plane.normal
    if is_ground:
        return "ground"
    if abs(up) > np.cos(np.radians(LEVEL_DEG)):
        return "top" if up > 0 else "soffit"
    compass = COMPASS[round(np.degrees(np.arctan2(east, north)) / 45.0) % 8]
    return f"{'wall' if abs(up) < np.sin(np.radians(LEVEL_DEG)) else 'slope'}-{compass}"


def _order(surfaces: Sequence[Surface]) -> Indices:
    """Indices that sort surfaces of one group by place along the facing, then along u, then along v."""
    middles = np.array([middle_m(surface) for surface in surfaces])
    moved = middles - middles.mean(axis=0)  # else a tilt of 0.1° counts by the distance from the origin
    axes = np.array([Frame.of(surface).axes for surface in surfaces])
    u, v, along = np.einsum("ni,nik->kn", moved, axes)
    return np.lexsort((v, _levels(u, SAME_COLUMN_M), _levels(along, SAME_PLANE_M)))


def _levels(values: Floats, gap: float) -> Indices:
    """(N,) rank of each value, where values in a row closer than `gap` to the next share a rank."""
    order = np.argsort(values, kind="stable")
    rank = np.zeros(len(values), dtype=np.int64)
    rank[order[1:]] = np.cumsum(np.diff(values[order]) > gap)
    return rank
