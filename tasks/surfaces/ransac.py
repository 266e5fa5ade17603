"""Planes by efficient RANSAC (after Schnabel, Wahl, Klein 2007; the paper's plane step).

Minimal samples are drawn locally, where three points are likely to lie on one plane; normals must agree;
a plane's support is the connected part around its sample, not everything that happens to be level with it;
one pass over the cloud yields many planes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tasks.surfaces.cloud import Cloud, Floats, Indices, Mask
from tasks.surfaces.frame import Frame
from tasks.surfaces.grid import Grid
from tasks.surfaces.plane_fit import fit_plane, fit_planes
from tasks.surfaces.plane_support import best_samples, connected_support, support_counts

NORMAL_TOLERANCE_DEG = 30.0  # of a point's normal: normals near an edge, or of noisy scans, tilt this far
SAMPLES = 24  # minimal samples per cell: with half its points on one plane, all miss it once in 25 cells
FEWEST = 6  # points that make a candidate
RANKED_ON = 4096  # points that candidates are compared on
GROWTHS = 30  # fits while a support grows; it stops as soon as nothing is added
PASSES = 6


@dataclass(frozen=True)
class Support:
    """A plane and the points that carry it. normal: (3,) unit, on the side it was seen from; centroid: (3,)
    on the plane; points: their indices, ascending."""

    normal: Floats
    centroid: Floats
    points: Indices


def find_planes(
    cloud: Cloud,
    distance_m: float,
    cell_m: float,
    smallest_m2: float,
    seed: int,
    on_progress: Callable[[float], None],
) -> list[Support]:
    """Planes whose points within `distance_m` span at least `smallest_m2`, largest candidates first.

    Supports do not share points. Neighbouring cells of side `cell_m` are connected.
    """
    if len(cloud) < FEWEST:
        return []
    search = _Search(cloud, distance_m, cell_m, np.random.default_rng(seed))
    supports: list[Support] = []
    for turn in range(PASSES):
        candidates = search.candidates()
        found_before = len(supports)
        for rank, (cell, plane) in enumerate(candidates):
            if rank % 64 == 0:
                on_progress((turn + rank / len(candidates)) / PASSES)
            support = search.grow(cell, plane)
            if support is not None and search.spanned_m2(support) >= smallest_m2:
                search.free[support.points] = False
                supports.append(Support(support.normal, support.centroid, search.grid.order[support.points]))
        if len(supports) == found_before:
            break
    on_progress(1.0)
    return [Support(s.normal, s.centroid, np.sort(s.points)) for s in supports]


class _Search:
    """The cloud, cell after cell, and which of its points no plane has taken yet."""

    def __init__(self, cloud: Cloud, distance_m: float, cell_m: float, rng: np.random.Generator) -> None:
        self.grid = Grid(cloud.points, cell_m)
        self.cloud = cloud[self.grid.order]
        self.free: Mask = np.ones(len(cloud), dtype=np.bool_)
        self.limits = (distance_m, float(np.cos(np.radians(NORMAL_TOLERANCE_DEG))))
        self.rng = rng
        self.seen = np.zeros(len(self.grid.start) - 1, dtype=np.int64)
        self.turns = 0

    def candidates(self) -> list[tuple[int, Floats]]:
        """Cell and plane (4,): the best of SAMPLES minimal samples of each cell, refitted to its inliers
        there; in falling order of support among a random subset of the free points."""
        cells = len(self.grid.start) - 1
        draws = self.rng.random((cells, SAMPLES, 3))
        inlier, counts = best_samples(*self._arrays(), self.free, self.grid.start, draws, *self.limits)
        drawn = np.flatnonzero(counts >= FEWEST)
        rank = np.full(cells, -1)
        rank[drawn] = np.arange(len(drawn))
        used = inlier & (rank[self.grid.cell] >= 0)
        group = rank[self.grid.cell[used]]
        views: Floats = np.zeros((len(drawn), 3))
        np.add.at(views, group, self.cloud.views[used])
        centroids, normals = fit_planes(self.cloud.points[used], group, views)
        planes = np.column_stack([normals, -np.einsum("ki,ki->k", normals, centroids)])

        left = np.flatnonzero(self.free)
        subset = np.sort(self.rng.choice(left, min(RANKED_ON, len(left)), replace=False))
        scores = support_counts(*self._arrays(subset), planes, *self.limits)
        order = np.lexsort((-counts[drawn], -scores))
        return [(int(drawn[k]), planes[k]) for k in order]

    def grow(self, cell: int, plane: Floats) -> Support | None:
        """Fit, gather the connected points within reach, fit again: the support grows as the fit sharpens.

        None where most of the candidate's points belong to a plane found since.
        """
        if self.free[self.grid.start[cell] : self.grid.start[cell + 1]].sum() < FEWEST:
            return None
        normal, centroid = plane[:3], -plane[3] * plane[:3]
        points = np.zeros(0, dtype=np.int64)
        for _ in range(GROWTHS):
            self.turns += 1
            grown = connected_support(
                *self._arrays(), self.free, self.grid.start, self.grid.neighbours,
                cell, self.seen, self.turns, np.append(normal, -(normal * centroid).sum()), *self.limits,
            )  # fmt: skip
            if len(grown) < FEWEST or np.array_equal(grown, points):
                break
            points = grown
            centroid, normal = fit_plane(self.cloud.points[points], normal)
        return Support(normal, centroid, points) if len(points) else None

    def spanned_m2(self, support: Support) -> float:
        """Area of the in-plane box around a support: no outline of it can be larger."""
        uvw_m = Frame.on(support.centroid, support.normal).uvw_m(self.cloud.points[support.points])
        return float(np.prod(np.ptp(uvw_m[:, :2], axis=0)))

    def _arrays(self, chosen: Indices | slice = slice(None)) -> tuple[Floats, Floats, Floats]:
        return self.cloud.points[chosen], self.cloud.normals[chosen], self.cloud.views[chosen]
