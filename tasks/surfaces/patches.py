"""From a plane's support to surfaces: pieces told apart, refitted, outlined, with their frame and area."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import ConvexHull

from schemas.contract import Vector2
from schemas.plane import Plane
from schemas.surface import Surface
from tasks.surfaces.cloud import Floats, Indices
from tasks.surfaces.frame import Frame, vector3
from tasks.surfaces.outline import outline_parts
from tasks.surfaces.plane_fit import fit_plane

FINEST_M = 0.05  # gaps of a tenth of a metre between samples are always bridged
FEWEST_POINTS = 50  # on a surface; fewer fall into a plane by chance
TRIM_SIGMA = 3.0
FITS = 4


@dataclass(frozen=True)
class Patch:
    """A surface without its name, and the indices of the points that carry it."""

    surface: Surface
    points: Indices


def patches(
    points_m: Floats,
    support: Indices,
    facing: Floats,
    narrowest_m: float,
    widest_m: float,
    smallest_m2: float,
) -> list[Patch]:
    """The surfaces on one plane, largest first.

    points_m: (N, 3) the whole cloud; support: indices of those on the plane; facing: (3,) roughly its
    normal. Gaps are bridged up to twice `widest_m`; what is narrower than `narrowest_m` is no surface.
    """
    if len(support) < FEWEST_POINTS:
        return []
    frame = Frame.on(*fit_plane(points_m[support], facing))
    uv_m = frame.uvw_m(points_m[support])[:, :2]
    parts = outline_parts(uv_m, FINEST_M, widest_m, narrowest_m, smallest_m2)
    return [
        Patch(_surface(points_m[support[part.members]], frame, part.polygon), support[part.members])
        for part in parts
        if part.members.sum() >= FEWEST_POINTS
    ]


def _surface(points_m: Floats, rough: Frame, polygon: shapely.Polygon) -> Surface:
    """Refitted to its own points by least squares; (u, v) = (0, 0) is the outline's lower left corner."""
    kept = points_m
    for _ in range(FITS):
        fitted = Frame.on(*fit_plane(kept, rough.normal))
        w_m = fitted.uvw_m(points_m)[:, 2]
        sigma_m = float(np.median(np.abs(w_m))) / 0.6745  # of a normal distribution with outliers
        kept = points_m[np.abs(w_m) <= TRIM_SIGMA * sigma_m] if sigma_m > 0 else points_m
    outline = shapely.transform(polygon, lambda uv: fitted.uvw_m(rough.world_m(uv))[:, :2])
    corner = np.array(outline.bounds[:2])
    frame = Frame(fitted.world_m(corner[None])[0], fitted.axes)
    outline = shapely.transform(outline, lambda uv: uv - corner)
    uvw_m = frame.uvw_m(points_m)
    return Surface(
        name="",
        plane=Plane.through(frame.origin, frame.normal),
        origin_m=vector3(frame.origin),
        u=vector3(frame.axes[:, 0]),
        v=vector3(frame.axes[:, 1]),
        outline_m=_ring(shapely.get_coordinates(outline.exterior)[:-1]),
        holes_m=tuple(_ring(shapely.get_coordinates(hole)[:-1]) for hole in outline.interiors),
        hull_m=_ring(uvw_m[ConvexHull(uvw_m[:, :2]).vertices, :2]),
        area_m2=float(outline.area),
        rms_m=float(np.sqrt(np.mean(uvw_m[:, 2] ** 2))),
        deviation_m=float(np.quantile(np.abs(uvw_m[:, 2]), 0.95)),
        points=len(points_m),
    )


def _ring(uv_m: Floats) -> tuple[Vector2, ...]:
    return tuple((float(u), float(v)) for u, v in np.round(uv_m, 4))
