"""A structure that a person may have edited by hand, or made with another tool."""

from collections import Counter
from pathlib import Path

import numpy as np
from shapely import Polygon, union_all

from flows.plain_files import read_contract
from schemas.problem import BadInput
from schemas.structure import Structure
from schemas.surface import Surface

SQUARE = 1e-3  # how far axes may be from unit length and from perpendicular
REMEDY = "Correct it, or take the surfaces.json that `hairline surfaces` wrote"


def read_structure(path: Path) -> Structure:
    """BadInput where a surface is none that a flight could be planned for."""
    structure = read_contract(path, Structure)
    for surface in structure.surfaces:
        fault = _fault(surface)
        if fault:
            raise BadInput(f"{path}: surface {surface.name!r}", fault, REMEDY)
    names = Counter(surface.name for surface in structure.surfaces)
    for name, count in names.items():
        if count > 1:
            raise BadInput(str(path), f"calls {count} surfaces {name!r}", "Give each a name of its own")
    return structure


def _fault(surface: Surface) -> str | None:
    axes = surface.R_world_surface
    if not np.allclose(axes.T @ axes, np.eye(3), atol=SQUARE) or np.linalg.det(axes) < 0:
        return "its u, v and normal are not perpendicular unit vectors, right-handed in this order"
    if len(surface.outline_m) < 3:
        return "its outline_m has fewer than three corners"
    outline = Polygon(surface.outline_m)
    if not outline.is_valid:
        return "its outline_m crosses itself"
    if any(len(hole) < 3 for hole in surface.holes_m):
        return "one of its holes_m has fewer than three corners"
    if outline.difference(union_all([Polygon(hole) for hole in surface.holes_m])).area <= 0.0:
        return "its holes_m leave nothing of it"
    return None
