"""The second of two passes: surfaces cut down to strips along cracks that the first pass found."""

from collections.abc import Sequence

import numpy as np
import shapely

from schemas.crack import Crack
from schemas.problem import BadInput
from schemas.surface import Surface

BESIDE_M = 0.05  # of a crack on either side, also shown
CORNER_M = 0.01  # corners of a strip closer to its straight sides than this are left out


def close_ups(surfaces: Sequence[Surface], cracks: Sequence[Crack]) -> tuple[Surface, ...]:
    """A strip for each crack that has a place in the world, named after it, on the surface that it lies on.

    Raises BadInput where no crack can be placed."""
    known = {surface.name: surface for surface in surfaces}
    strips = []
    for crack in cracks:
        surface = known.get(crack.surface)
        if surface is None or len(crack.polyline_world_m) < 2:
            continue
        uv = surface.to_surface(np.array(crack.polyline_world_m))[:, :2]
        strip = shapely.LineString(uv).buffer(BESIDE_M, cap_style="square").simplify(CORNER_M)
        ring = tuple((float(u), float(v)) for u, v in shapely.orient_polygons(strip).exterior.coords[:-1])
        hull = tuple((float(u), float(v)) for u, v in strip.convex_hull.exterior.coords[:-1])
        changed = {"name": crack.id, "outline_m": ring, "holes_m": (), "hull_m": hull}
        strips.append(surface.model_copy(update={**changed, "area_m2": float(strip.area)}))
    if not strips:
        raise BadInput(
            "cracks",
            f"none of the {len(cracks)} cracks lies in the world on a surface of this structure",
            "Give the cracks.json of an inspection that planned its photos on the same surfaces.json.",
        )
    return tuple(strips)
