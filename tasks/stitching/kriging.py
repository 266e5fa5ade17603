"""The relief of a surface from the heights of points on it: likeliest where it is a Gaussian process
(kriging, Matheron 1963), as the nearest points tell it (Datta et al. 2016)."""

from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tasks.stitching.heights import Heights
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import Index
from tasks.stitching.view import Array

THINNED = 0.5  # of a mean distance of points: nearer ones are one
FINE = 1.0 / 6.0  # of the reach, cells of the map: linear between them, it errs by 2 % of the heights
NEAREST = 24  # points that tell the height of a place
REACHES = 2.0 ** np.arange(0.0, 5.0, 0.5)  # over which heights may be alike, in mean distances of points
ALONE = (0.0, 0.03, 0.3)  # share of their variance that may be each point's own
TRIED = 500  # points, to tell these two
ODD = 4.0  # sigma: points so far off show something else, or are false
TOGETHER = 4096  # places, in one go


class Process(NamedTuple):
    """Of heights: how alike they are so far apart."""

    sigma: float
    reach: float  # over which they are alike, plane units
    alone: float  # share of sigma² that each point has for itself: edges, and what is no surface

    def alike(self, apart: Array) -> Array:
        """Covariance of places so far apart (Matérn, ν = 5/2: bends, but has no edges)."""
        s = np.sqrt(5.0) * apart / self.reach
        return np.asarray(self.sigma**2 * (1.0 - self.alone) * (1.0 + s + s * s / 3.0) * np.exp(-s))


@dataclass(frozen=True)
class Known:
    """What points say of the surface."""

    at: Array  # (N, 2)
    w: Array  # (N,) over the mean height
    sigma: Array  # (N,)
    tree: cKDTree

    def foretold(self, process: Process, at: Array, skipped: int = 0) -> tuple[Array, Array]:
        """(K,) heights and (K,) variances of the surface at (K, 2), by the nearest points but the first so
        many."""
        near = min(NEAREST, len(self.w) - skipped)
        w, variance = np.empty(len(at)), np.empty(len(at))
        for k in range(0, len(at), TOGETHER):
            part = slice(k, k + TOGETHER)
            away, which = self.tree.query(at[part], k=np.arange(skipped, skipped + near) + 1)
            around = self.at[which]
            among = process.alike(np.linalg.norm(around[:, :, None] - around[:, None], axis=-1))
            among[:, range(near), range(near)] += self.sigma[which] ** 2 + process.alone * process.sigma**2
            alike = process.alike(away)
            weight = np.linalg.solve(among, alike[..., None])[..., 0]
            w[part] = (weight * self.w[which]).sum(axis=1)
            variance[part] = process.sigma**2 * (1.0 - process.alone) - (weight * alike).sum(axis=1)
        return w, np.maximum(variance, 0.0)

    def odd(self, process: Process, which: Index) -> tuple[Array, Array]:
        """(K,) how far these points are from where the others foretell them, and (K,) that variance."""
        w, variance = self.foretold(process, self.at[which], skipped=1)
        return self.w[which] - w, variance + process.alone * process.sigma**2 + self.sigma[which] ** 2

    def without_odd(self, process: Process) -> "Known":
        """Without the points that the others belie."""
        off, variance = self.odd(process, np.arange(len(self.w)))
        good = off**2 < ODD**2 * variance
        return Known(self.at[good], self.w[good], self.sigma[good], cKDTree(self.at[good]))


def relief_of(heights: Heights) -> tuple[HeightMap, HeightMap]:
    """The surface, and 1σ of its height: far from any point that of a place of which nothing is known."""
    low, size = heights.at.min(axis=0), np.ptp(heights.at, axis=0)
    spacing = _spacing(heights.at - low, size)
    known, mean = _known(heights, low, THINNED * spacing)
    process = _likeliest(known, heights.usual, spacing)
    known = known.without_odd(process)
    cell = max(THINNED * spacing, FINE * process.reach)
    columns, rows = (max(2, int(n)) for n in np.ceil(size / cell) + 1)
    u, v = np.meshgrid(low[0] + cell * np.arange(columns), low[1] + cell * np.arange(rows))
    w, variance = known.foretold(process, np.column_stack([u.ravel(), v.ravel()]))
    relief = HeightMap((mean + w).reshape(rows, columns), float(low[0]), float(low[1]), cell)
    return relief, replace(relief, w=np.sqrt(variance).reshape(rows, columns))


def _spacing(at: Array, size: Array) -> float:
    """Mean distance of points where there are any: they may lie along a diagonal, or around a corner."""
    spacing = max(float(np.sqrt(size.prod() / len(at))), float(size.max()) / len(at))
    for _ in range(3):  # finer squares follow what is there more closely
        squares = np.unique(np.floor(at / (2.0 * spacing)).astype(np.int64), axis=0)
        spacing = min(spacing, float(2.0 * spacing * np.sqrt(len(squares) / len(at))))
    return spacing


def _known(heights: Heights, low: Array, cell: float) -> tuple[Known, float]:
    """One point a cell, the mean of those in it (else the nearest points would all lie on one side), over the
    mean height."""
    at = np.floor((heights.at - low) / cell).astype(np.int64)
    _, place = np.unique(at[:, 1] << 32 | at[:, 0], return_inverse=True)
    weight = heights.sigma**-2.0
    total = np.bincount(place, weight)
    u, v, w = (np.bincount(place, weight * x) / total for x in (*heights.at.T, heights.w))
    sigma, at_mean = np.asarray(total**-0.5, np.float64), np.column_stack([u, v])
    share = 1.0 / (sigma**2 + heights.usual**2)
    mean = float((share * w).sum() / share.sum())
    return Known(at_mean, w - mean, sigma, cKDTree(at_mean)), mean


def _likeliest(known: Known, sigma: float, spacing: float) -> Process:
    """The process under which each of some points is likeliest, told the others."""
    some = np.arange(0, len(known.w), max(1, len(known.w) // TRIED))
    best, chosen = np.inf, Process(sigma, spacing, 0.0)
    for reach, alone in product(REACHES, ALONE):
        process = Process(sigma, reach * spacing, alone)
        off, variance = known.odd(process, some)
        unlikely = float((np.log(variance) + np.minimum(off**2 / variance, ODD**2)).sum())
        if unlikely < best:
            best, chosen = unlikely, process
    return chosen
