"""Round piers and arches become strips of planes.

RANSAC lays planes along a curved part as chance has it, and in another order in the next run. Where planes
that touch lie on one circular cylinder, better than on themselves, its points are gathered and cut anew:
into equal strips, as few as keep every point within the distance of its strip's plane. A whole round is cut
from north (or from a level axis' top) on, an arc from its one end to the other, so that strips stay where
they are. Curves that are no circle keep the planes they have.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tasks.surfaces.cloud import Cloud, Floats, Indices, Mask
from tasks.surfaces.plane_cells import beside
from tasks.surfaces.plane_fit import fit_plane
from tasks.surfaces.ransac import Support

LEAST_TURN_DEG, MOST_TURN_DEG = 2.0, 60.0  # between neighbouring planes on a curve
LEAST_PLANES = 3
LARGEST_RADIUS_M = 60.0
ON_CYLINDER = 0.8  # of a plane's points, for it to be part of the curve
BETTER = 0.7  # residual on the cylinder per residual on the planes: a polygon's sides are no curve
JUDGED_ON = 4000  # points
FITS = 6
TRIED = 12  # starts, those that carry most first
_STRIDES = np.array([2**40, 2**20, 1])  # of a cell's number: a million cells along each axis
NORMAL_TOLERANCE_DEG = 30.0
SEAM_DEG = 15.0  # a gap less than this is no end of an arc
ENDS = 0.002  # share of an arc's points beyond either end: strays


@dataclass(frozen=True)
class Cylinder:
    """point (3,) on the axis (3,), unit; radius_m; outward: +1 where seen from outside, −1 from inside."""

    point: Floats
    axis: Floats
    radius_m: float
    outward: float

    def radial(self, points_m: Floats) -> Floats:
        """(N, 3) from the axis to each point, square to it."""
        moved = points_m - self.point
        return np.asarray(moved - np.einsum("ni,i->n", moved, self.axis)[:, None] * self.axis)

    def residual_m(self, points_m: Floats) -> Floats:
        return np.asarray(np.linalg.norm(self.radial(points_m), axis=1) - self.radius_m)

    def turn(self, points_m: Floats) -> Floats:
        """(N,) radians about the axis, 0 to 2π, from north (upright axes) or from the top."""
        from_m = np.array([0.0, 1.0, 0.0]) if abs(self.axis[2]) > np.sqrt(0.5) else np.array([0.0, 0.0, 1.0])
        x = from_m - (from_m * self.axis).sum() * self.axis
        x /= np.linalg.norm(x)
        radial = self.radial(points_m)
        angle = np.arctan2(
            np.einsum("ni,i->n", radial, np.cross(self.axis, x)), np.einsum("ni,i->n", radial, x)
        )
        return np.asarray(np.mod(angle, 2 * np.pi))


def cut_curves(supports: list[Support], cloud: Cloud, distance_m: float, reach_m: float) -> list[Support]:
    """Supports, those on curves replaced by equal strips. cloud: what they index; reach_m: how far apart
    points of one surface may be."""
    left = list(range(len(supports)))
    strips: list[Support] = []
    free = np.ones(len(cloud), dtype=bool)
    for support in supports:
        free[support.points] = False
    for chain in _chains(supports, cloud, reach_m):
        waiting = chain
        while len(waiting) >= LEAST_PLANES:
            found = _cylinder(
                [supports[k] for k in waiting], _links(supports, waiting, cloud, reach_m), cloud, distance_m
            )
            if found is None:
                break
            cylinder, members = found
            own = [waiting[k] for k in members]
            for k in own:
                free[supports[k].points] = True
            points = _gathered(cylinder, [supports[k] for k in own], free, cloud, distance_m, reach_m)
            cut = _strips(cylinder, points, cloud, distance_m)
            for strip in cut:
                free[strip.points] = False
            strips += cut
            waiting = [k for k in waiting if k not in own]
            left = [k for k in left if k not in own]
    return [*(supports[k] for k in left), *strips]


def _links(supports: list[Support], chosen: list[int], cloud: Cloud, reach_m: float) -> list[tuple[int, int]]:
    """Pairs (positions in `chosen`) that touch and turn a little."""
    most, least = np.cos(np.radians([MOST_TURN_DEG, LEAST_TURN_DEG]))
    cells = [_cells(cloud.points[supports[k].points], reach_m / 2) for k in chosen]
    around = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3) @ _STRIDES
    found = []
    for a, own in enumerate(cells):
        beside_own = np.unique(own[:, None] + around)
        for b in range(a + 1, len(cells)):
            facing = float((supports[chosen[a]].normal * supports[chosen[b]].normal).sum())
            if most <= facing <= least and np.isin(cells[b], beside_own, assume_unique=True).any():
                found.append((a, b))
    return found


def _cells(points_m: Floats, cell_m: float) -> Indices:
    return np.unique(np.floor(points_m / cell_m).astype(np.int64) @ _STRIDES)


def _across(normal: Floats) -> Floats:
    """(3, 2) two unit vectors square to the normal and to each other."""
    least = np.eye(3)[np.abs(normal).argmin()]
    u = np.cross(normal, least)
    u /= np.linalg.norm(u)
    return np.column_stack([u, np.cross(normal, u)])


def _chains(supports: list[Support], cloud: Cloud, reach_m: float) -> list[list[int]]:
    """Groups of at least LEAST_PLANES planes, each linked to some other of the group."""
    count = len(supports)
    pairs = np.array(_links(supports, list(range(count)), cloud, reach_m)).reshape(-1, 2)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    labels = connected_components(graph, directed=False)[1]
    groups = [np.flatnonzero(labels == label).tolist() for label in range(labels.max(initial=-1) + 1)]
    return [group for group in groups if len(group) >= LEAST_PLANES]


def _cylinder(
    supports: list[Support], links: list[tuple[int, int]], cloud: Cloud, distance_m: float
) -> tuple[Cylinder, list[int]] | None:
    """The cylinder that carries most of the chain, and which supports lie on it."""
    samples = [cloud.points[_some(s.points, JUDGED_ON // len(supports) + 1)] for s in supports]
    weights = np.array([len(s.points) for s in supports])
    starts = []
    for a, b in links:
        start = _through(supports[a], supports[b])
        if start is not None and start.radius_m <= LARGEST_RADIUS_M:
            on_it = _shares_on(start, samples, distance_m) >= ON_CYLINDER
            starts.append((float((weights * on_it).sum()), start))
    starts.sort(key=lambda one: -one[0])
    for _, start in starts[:TRIED]:
        found = _grown(start, supports, samples, distance_m)
        if found is not None:
            return found
    return None


def _shares_on(cylinder: Cylinder, samples: list[Floats], distance_m: float) -> Floats:
    return np.array([float((np.abs(cylinder.residual_m(p)) <= 2 * distance_m).mean()) for p in samples])


def _grown(
    start: Cylinder, supports: list[Support], samples: list[Floats], distance_m: float
) -> tuple[Cylinder, list[int]] | None:
    """Fitted to the planes on it; None where it does not explain them better than they themselves do."""
    best, members = start, []
    for _ in range(FITS):
        members = np.flatnonzero(_shares_on(best, samples, distance_m) >= ON_CYLINDER).tolist()
        if len(members) < LEAST_PLANES:
            return None
        best = _refined(best, np.concatenate([samples[k] for k in members]), distance_m)
    heights = [np.einsum("ni,i->n", samples[k] - supports[k].centroid, supports[k].normal) for k in members]
    residuals = best.residual_m(np.concatenate([samples[k] for k in members]))
    if np.median(np.abs(residuals)) > BETTER * np.median(np.abs(np.concatenate(heights))):
        return None
    return (best, members) if best.radius_m <= LARGEST_RADIUS_M else None


def _some(points: Indices, count: int) -> Indices:
    return points[:: max(1, len(points) // count)]


def _through(one: Support, other: Support) -> Cylinder | None:
    """The cylinder that both planes touch in their middles: its axis is where their normals meet."""
    axis = np.cross(one.normal, other.normal)
    axis /= np.linalg.norm(axis)
    between = other.centroid - one.centroid
    between -= (between * axis).sum() * axis
    matrix = np.column_stack([one.normal, -other.normal, axis])
    along = np.linalg.solve(matrix, between)
    if along[0] * along[1] <= 0:
        return None
    centre = one.centroid + along[0] * one.normal
    return Cylinder(centre, axis, float(np.abs(along[:2]).mean()), -float(np.sign(along[0])))


def _refined(start: Cylinder, points_m: Floats, distance_m: float) -> Cylinder:
    """Gauss–Newton on the residuals, far points left out. Unknown: shift and tilt across the axis, radius."""
    across = _across(start.axis)
    residual_m = start.residual_m(points_m)
    near = points_m[np.abs(residual_m) <= 2 * distance_m]
    residual_m = start.residual_m(near)
    out = start.radial(near)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    middle = start.point + np.einsum("ni,i->n", near - start.point, start.axis).mean() * start.axis
    lever = np.einsum("ni,i->n", near - middle, start.axis)
    toward = np.einsum("ni,ik->nk", out, across)
    jacobian = np.column_stack([-toward, -toward * lever[:, None], -np.ones(len(near))])
    normal = np.einsum("ni,nj->ij", jacobian, jacobian)
    step = -np.linalg.solve(
        normal + 1e-9 * np.trace(normal) * np.eye(5), np.einsum("ni,n->i", jacobian, residual_m)
    )
    axis = start.axis + (across * step[2:4]).sum(axis=1)
    return Cylinder(
        middle + (across * step[:2]).sum(axis=1),
        axis / np.linalg.norm(axis),
        start.radius_m + float(step[4]),
        start.outward,
    )


def _gathered(
    cylinder: Cylinder, members: list[Support], free: Mask, cloud: Cloud, distance_m: float, reach_m: float
) -> Indices:
    """The free points on the cylinder, seen from its side, beside its planes' points; ascending."""
    out = cylinder.radial(cloud.points) * cylinder.outward
    length = np.maximum(np.linalg.norm(out, axis=1), 1e-9)
    near = free & (np.abs(length - cylinder.radius_m) <= distance_m)
    near &= np.abs(np.einsum("ni,ni->n", out, cloud.normals)) >= length * np.cos(
        np.radians(NORMAL_TOLERANCE_DEG)
    )
    near &= np.einsum("ni,ni->n", out, cloud.views) > 0
    chosen = np.flatnonzero(near)
    known = np.concatenate([m.points for m in members])
    flat_chosen, flat_known = (_unrolled(cylinder, cloud.points[p]) for p in (chosen, known))
    return chosen[beside(flat_chosen, flat_known, reach_m / 2, around=1)]


def _unrolled(cylinder: Cylinder, points_m: Floats) -> Floats:
    """(N, 3): metres along the turn, along the axis, 0."""
    along = np.einsum("ni,i->n", points_m - cylinder.point, cylinder.axis)
    return np.column_stack([cylinder.turn(points_m) * cylinder.radius_m, along, np.zeros(len(points_m))])


def _strips(cylinder: Cylinder, points: Indices, cloud: Cloud, distance_m: float) -> list[Support]:
    """Equal strips. A least-squares plane leaves two thirds of the sagitta on one side at most."""
    turn = cylinder.turn(cloud.points[points])
    widest = 2 * np.arccos(max(1 - 1.5 * distance_m / cylinder.radius_m, 0.0))
    start, arc = _arc(turn)
    count = int(np.ceil(arc / widest))
    count += count % 16 == 0 and arc == 2 * np.pi  # else a strip would face midway between two compass points
    width = arc / count
    if arc == 2 * np.pi:
        start = -width / 2
    before = (2 * np.pi - arc) / 2  # strays before the start of an arc are not those after its end
    number = np.clip((np.mod(turn - start + before, 2 * np.pi) - before) // width, 0, count - 1)
    strips = []
    for k in range(count):
        own = points[number == k]
        if len(own) > 2:
            facing = cylinder.radial(cloud.points[own]).mean(axis=0) * cylinder.outward
            centroid, normal = fit_plane(cloud.points[own], facing)
            strips.append(Support(normal, centroid, own))
    return strips


def _arc(turn: Floats) -> tuple[float, float]:
    """Where the turns begin and how far they reach; 2π where they have no wide gap."""
    ordered = np.sort(turn)
    gaps = np.diff(ordered, append=ordered[0] + 2 * np.pi)
    widest = int(gaps.argmax())
    if gaps[widest] < np.radians(SEAM_DEG):
        return 0.0, 2 * np.pi
    begin = ordered[(widest + 1) % len(ordered)]
    low, high = np.quantile(np.mod(turn - begin, 2 * np.pi), [ENDS, 1 - ENDS])
    return float(begin + low), float(high - low)
