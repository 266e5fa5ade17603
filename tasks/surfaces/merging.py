"""Planes that are one surface are made one.

RANSAC splits a surface where it bends a little or where its noise exceeds the inlier distance; it then finds
a second plane among what the first one left. Two planes are one surface when they face the same way, touch,
and either one plane carries both within the inlier distance, or their points interleave (one would hide the
other if they were two) and one plane carries them within twice that distance. A step is neither.

Two planes in one place that face opposite ways are a thin sheet scanned from both sides; but where the
scanners' places are not known, some normals may point the wrong way: then the side with more points has all.
"""

import numpy as np

from tasks.surfaces.boxes import Box
from tasks.surfaces.cloud import Cloud
from tasks.surfaces.frame import Frame
from tasks.surfaces.plane_cells import beside
from tasks.surfaces.plane_fit import fit_plane
from tasks.surfaces.ransac import Support

SAME_FACING_DEG = 10.0
CARRIED = 0.95  # of the points of each, by the common plane
INTERLEAVED = 0.3  # of the smaller one's points, with points of the larger one around them
INTERLEAVED_CELL_M = 0.15


def merge_planes(supports: list[Support], cloud: Cloud, distance_m: float, reach_m: float) -> list[Support]:
    """Supports in order of size, those that are one surface joined. cloud: what they index; reach_m: how far
    apart their points may be and still touch."""
    pending = sorted(supports, key=lambda support: -len(support.points))
    boxes = [Box.of(cloud.points[support.points]) for support in pending]
    farthest_m = float(np.hypot(2 * np.sqrt(2) * reach_m, 4 * distance_m))
    merged: list[Support] = []
    while pending:
        whole, *pending = pending
        del boxes[0]
        again = True
        while again:
            again = False
            reach = Box.of(cloud.points[whole.points]).grown(farthest_m)
            for number, other in enumerate(pending):
                if not reach.meets(boxes[number]):
                    continue
                union = _union(whole, other, cloud, distance_m, reach_m)
                if union is not None:
                    whole, again = union, True
                    del boxes[number]
                    del pending[number]
                    break
        merged.append(whole)
    return merged


def _union(large: Support, small: Support, cloud: Cloud, distance_m: float, reach_m: float) -> Support | None:
    facing = float((large.normal * small.normal).sum())
    if (facing if cloud.sides_known else abs(facing)) < np.cos(np.radians(SAME_FACING_DEG)):
        return None
    points_m = cloud.points
    frame = Frame.on(large.centroid, large.normal)
    uvw_small = frame.uvw_m(points_m[small.points])
    near = np.abs(uvw_small[:, 2]) <= 4 * distance_m
    if not near.any():
        return None
    uvw_large = frame.uvw_m(points_m[large.points])
    if not beside(uvw_small[near], uvw_large, reach_m, around=1).any():
        return None
    interleaved = float(beside(uvw_small, uvw_large, INTERLEAVED_CELL_M).mean()) >= INTERLEAVED
    if facing < 0:
        in_place = beside(uvw_large, uvw_small, INTERLEAVED_CELL_M).sum()
        if not interleaved or len(small.points) > in_place:
            return None
    both = np.sort(np.concatenate([large.points, small.points]))
    common = Frame.on(*fit_plane(points_m[both], large.normal))
    heights_m = [np.abs(common.uvw_m(points_m[support.points])[:, 2]) for support in (large, small)]
    limit_m = 2 * distance_m if interleaved else distance_m
    if min(float((h <= limit_m).mean()) for h in heights_m) < CARRIED:
        return None
    return Support(common.normal, common.origin, both)
