"""Points near an edge belong to the planes that meet there.

Their normals mix both faces, so RANSAC leaves them out, and every surface comes out too small by a sample or
two; or it lays a bent sliver through them. Once the planes are known, such slivers are dissolved and each
edge point goes to the nearest plane that its neighbours lie on.
"""

import numpy as np

from tasks.surfaces.boxes import Box, Sorted
from tasks.surfaces.cloud import Cloud, Indices, Mask
from tasks.surfaces.frame import Frame
from tasks.surfaces.plane_cells import beside
from tasks.surfaces.ransac import Support

REACH_M = 0.15  # side of the in-plane cells; a point joins from the next cell at most
MOST_SHARED = 0.5  # of a plane's points on larger planes


def without_slivers(supports: list[Support], cloud: Cloud, distance_m: float) -> list[Support]:
    """Supports, largest first, without those whose points mostly lie on larger ones they touch."""
    kept: list[Support] = []
    reaches: list[Box] = []
    for support in sorted(supports, key=lambda support: -len(support.points)):
        shared = np.zeros(len(support.points), dtype=bool)
        own = Box.of(cloud.points[support.points])
        for larger, reach in zip(kept, reaches, strict=True):
            if reach.meets(own):
                shared |= _near(cloud, support.points, larger, distance_m)
        if shared.mean() <= MOST_SHARED:
            kept.append(support)
            reaches.append(own.grown(_farthest_m(distance_m)))
    return kept


def with_edge_points(supports: list[Support], cloud: Cloud, distance_m: float) -> list[Indices]:
    """Each support's points, ascending, with those of no support that lie within `distance_m` of its plane
    beside its points and were seen from its side; each goes to its nearest plane."""
    free = np.ones(len(cloud), dtype=bool)
    for support in supports:
        free[support.points] = False
    left = np.flatnonzero(free)
    around = Sorted(cloud.points[left])
    nearest_m = np.full(len(left), np.inf)
    owner = np.full(len(left), -1)
    for number, support in enumerate(supports):
        near = around.inside(Box.of(cloud.points[support.points]).grown(_farthest_m(distance_m)))
        near = near[_near(cloud, left[near], support, distance_m)]
        moved = cloud.points[left[near]] - support.centroid
        height_m = np.abs(np.einsum("ni,i->n", moved, support.normal))
        closer = height_m < nearest_m[near]
        owner[near[closer]], nearest_m[near[closer]] = number, height_m[closer]
    return [
        np.sort(np.concatenate([support.points, left[owner == number]]))
        for number, support in enumerate(supports)
    ]


def _farthest_m(distance_m: float) -> float:
    """That a point near a support may lie from it: two cells along u and along v, and off the plane."""
    return float(np.hypot(2 * np.sqrt(2) * REACH_M, distance_m))


def _near(cloud: Cloud, chosen: Indices, support: Support, distance_m: float) -> Mask:
    """(K,) which of the chosen points lie within `distance_m` of the support's plane, beside its points, and
    were seen from its side."""
    frame = Frame.on(support.centroid, support.normal)
    uvw_m = frame.uvw_m(cloud.points[chosen])
    near = np.abs(uvw_m[:, 2]) <= distance_m
    near &= np.einsum("ni,i->n", cloud.views[chosen], support.normal) > 0
    if near.any():
        near[near] = beside(uvw_m[near], frame.uvw_m(cloud.points[support.points]), REACH_M, around=1)
    return near
