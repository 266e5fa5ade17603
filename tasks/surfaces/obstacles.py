"""Obstacles: what remains of the cloud when the surfaces are out, in groups at distance ε (paper, eq. 2)."""

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.spatial import ConvexHull

from schemas.obstacle import Obstacle
from schemas.surface import Surface
from tasks.surfaces.cloud import Floats, Indices, Mask
from tasks.surfaces.clusters import euclidean_clusters
from tasks.surfaces.frame import Frame, vector3

FEWEST_POINTS = 5  # fewer is noise that the filter left; a cable has more
FLAT_M = 1e-3  # thinner than this has no volume to build a hull on


def on_surfaces(points_m: Floats, surfaces: Sequence[Surface], within_m: float, beside_m: float) -> Mask:
    """(N,) points within `within_m` of a surface's plane and `beside_m` of its outline: edges and
    roughness of a surface are no obstacles."""
    explained = np.zeros(len(points_m), dtype=bool)
    for surface in surfaces:
        uvw_m = Frame.of(surface).uvw_m(points_m)
        near = np.flatnonzero(np.abs(uvw_m[:, 2]) <= within_m)
        reach = shapely.Polygon(surface.outline_m, surface.holes_m).buffer(beside_m)
        shapely.prepare(reach)
        explained[near] |= shapely.contains_xy(reach, uvw_m[near, 0], uvw_m[near, 1])
    return explained


def obstacles(points_m: Floats, epsilon_m: float) -> tuple[tuple[Obstacle, ...], Mask]:
    """Obstacles, numbered from west to east, and (N,) which points they hold; the rest is noise."""
    labels = euclidean_clusters(points_m, epsilon_m)
    sizes = np.bincount(labels)
    kept = sizes[labels] >= FEWEST_POINTS
    order = np.argsort(labels, kind="stable")
    groups = [g for g in np.split(order, np.cumsum(sizes)[:-1]) if len(g) >= FEWEST_POINTS]
    if not groups:
        return (), kept
    lows = np.array([points_m[g].min(axis=0) for g in groups])
    highs = np.array([points_m[g].max(axis=0) for g in groups])
    found = []
    for number, index in enumerate(np.lexsort((lows + highs).T[::-1]), start=1):
        group: Indices = groups[index]
        found.append(
            Obstacle(
                name=f"obstacle-{number:02d}",
                points=len(group),
                min_m=vector3(lows[index]),
                max_m=vector3(highs[index]),
                hull_m=tuple(vector3(p) for p in hull_vertices(points_m[group])),
            )
        )
    return tuple(found), kept


def hull_vertices(points_m: Floats) -> Floats:
    """(K, 3) vertices of the convex hull of (N, 3) points; flat points have a flat hull, a line two ends."""
    spread = points_m - points_m.mean(axis=0)
    axes = np.linalg.eigh(np.einsum("ni,nj->ij", spread, spread))[1][:, ::-1]  # the longest first
    along = np.einsum("ni,ik->nk", spread, axes)
    rank = int((np.ptp(along, axis=0) > FLAT_M).sum())
    if rank == 0:
        return points_m[:1]
    if rank == 1:
        return points_m[[along[:, 0].argmin(), along[:, 0].argmax()]]
    return np.asarray(points_m[np.sort(ConvexHull(along[:, :rank]).vertices)])
