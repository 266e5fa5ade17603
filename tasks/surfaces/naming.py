"""Names that say what a surface is and stay the same in every run.

A surface is called by the way it faces: `wall-south` (within 25° of upright, eight compass directions),
`soffit` (level, seen from below), `top` (level, seen from above), `ground` (the top that all stands on),
`slope-west` (between upright and level). Each group is numbered from back to front along its facing (so
soffits from the highest level down), on one plane from left to right as the viewer sees it, then from bottom
to top. The place along the facing is the one that scans measure to millimetres; places that differ by less
than scanner noise or a shadow's edge count as equal, so that they do not change the order.

What one scan shows and the next does not must not rename the rest. So numbers go first to the plain surfaces
of the structure, then to those so small that noise decides whether they are found, and to cars and whatever
else stands apart. Small is what lies below the widest gap among the areas: noise carries none across.
"""

from collections.abc import Sequence
from itertools import compress

import numpy as np
import shapely

from schemas.surface import Surface
from tasks.surfaces.cloud import Floats, Indices
from tasks.surfaces.frame import Frame

LEVEL_DEG = 25.0  # from level or from upright; as schemas.surface.in_plane_axes
COMPASS = ("north", "northeast", "east", "southeast", "south", "southwest", "west", "northwest")
SAME_PLANE_M = 0.07  # above registration error, no usual step
SMALL = 8.0  # in smallest surfaces: larger ones are found in every run
SAME_COLUMN_M = 0.35  # between the middles of surfaces above one another


def name_surfaces(
    surfaces: Sequence[Surface], ground: Sequence[bool], built: Sequence[bool], smallest_m2: float
) -> tuple[Surface, ...]:
    """Named, in the order of their names. ground: which of them are ground (ground.py says); built: which
    are of the structure (structure.py says); smallest_m2: smaller ones are not looked for."""
    groups = [_group(s, g) for s, g in zip(surfaces, ground, strict=True)]
    standing = [b and not g for b, g in zip(built, ground, strict=True)]
    plain_m2 = _plain_m2([s.area_m2 for s in compress(surfaces, standing)], smallest_m2)
    tiers = [
        0 if g else 2 * (not b) + (s.area_m2 < plain_m2)
        for s, g, b in zip(surfaces, ground, built, strict=True)
    ]
    named = []
    for group in sorted(set(groups)):
        members = [k for k, own in enumerate(groups) if own == group]
        ranked: list[Surface] = []
        for tier in sorted(set(tiers)):
            alike = [surfaces[k] for k in members if tiers[k] == tier]
            ranked += [alike[index] for index in _order(alike)]
        for number, surface in enumerate(ranked, start=1):
            named.append(surface.model_copy(update={"name": f"{group}-{number:02d}"}))
    return tuple(named)


def _plain_m2(areas_m2: Sequence[float], smallest_m2: float) -> float:
    """The middle of the widest gap (as a ratio) among areas up to SMALL times the smallest asked for."""
    areas = np.sort([smallest_m2, *(area for area in areas_m2 if area > smallest_m2)])
    low, high = areas[:-1], areas[1:]
    within = low <= SMALL * smallest_m2
    if not within.any():
        return smallest_m2
    widest = int(np.argmax(high[within] / low[within]))
    return float(np.sqrt(low[widest] * high[widest]))


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
    if not surfaces:
        return np.zeros(0, dtype=np.int64)
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
