"""Cables that return an echo here and there: lone points that line up.

A thin cable far from the scanner echoes too seldom for its points to be a group, or not to look like noise
beside a dense wall. Noise does not line up: some FEWEST lone points on one line within a few metres, with
little else beside it, are a cable's. It is there between its echoes too.
"""

from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from tasks.surfaces.cloud import Floats
from tasks.surfaces.voxels import thin

REACH_M = 3.0  # between a point and the others on its line; a cable sags by centimetres over it
ON_LINE_M, BESIDE_M = 0.05, 0.5
FEWEST = 5  # points on a line, its own included
MOSTLY = 0.6  # of the points beside a line are on it; where pulses met two things, they spread over a sheet
NEIGHBOURS = 32
HELD_M = 0.25  # spacing of points of obstacles: as few as lone ones
SPACING_M = 0.1  # of the points that stand for the cable
AT_ONCE = 2000


def cables(lone_m: Floats, held_m: Floats) -> Floats:
    """(K, 3) points along the cables that (N, 3) lone points tell of, from each of these to the next.
    held_m: (M, 3) points of obstacles, which may be parts of the same cables."""
    all_m = np.concatenate([lone_m, thin(held_m, HELD_M)])
    if len(all_m) < FEWEST:
        return np.zeros((0, 3))
    tree = cKDTree(all_m)
    around = np.vstack([all_m, np.full((1, 3), np.inf)])  # what the tree answers where there is no neighbour
    count = min(NEIGHBOURS + 1, len(all_m))
    ends = []
    for start in range(0, len(lone_m), AT_ONCE):
        here = lone_m[start : start + AT_ONCE]
        apart_m, near = (found[:, 1:] for found in tree.query(here, count, distance_upper_bound=REACH_M))
        known = np.isfinite(apart_m) & (apart_m > 0)
        ray = np.where(known[..., None], around[near] - here[:, None], 0.0)
        along = np.einsum("nki,nji->nkj", ray / np.where(known, apart_m, 1.0)[..., None], ray)
        off_m2 = (ray**2).sum(axis=2)[:, None] - along**2  # of neighbour j from the line to neighbour k
        on_line = (off_m2 <= ON_LINE_M**2) & known[:, None]
        on, beside = on_line.sum(axis=2), ((off_m2 <= BESIDE_M**2) & known[:, None]).sum(axis=2)
        alone = known & (on + 1 >= FEWEST) & (on + 1 >= MOSTLY * (beside + 1))
        for n in np.flatnonzero(alone.any(axis=1)):
            line = np.where(alone[n], on[n], 0).argmax()
            chosen = np.append(on_line[n, line], True)
            on_it = np.vstack([here[n] + ray[n], here[n]])[chosen]
            ordered = on_it[np.append(along[n, line], 0.0)[chosen].argsort()]
            ends += list(pairwise(ordered))
    return np.concatenate([np.zeros((0, 3)), *(_between(a, b) for a, b in ends)])


def _between(a: Floats, b: Floats) -> Floats:
    """(K, 3) from a to b, both included."""
    count = int(np.ceil(np.linalg.norm(b - a) / SPACING_M)) + 1
    return np.asarray(a + np.linspace(0.0, 1.0, count)[:, None] * (b - a))
