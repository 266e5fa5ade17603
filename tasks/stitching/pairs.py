"""An edge of the match graph: two photos that show the same part of the plane, and where."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from tasks.stitching.matching import Descriptors, Matches, match, match_guided
from tasks.stitching.prior import Prior
from tasks.stitching.verification import tolerance_px, transfer, verify

ENOUGH = 120  # matches of a pair that go into the adjustment, spread over it
FEW = 1000  # strongest features of each photo, matched first: the cost is their product
LIKELY = 0.05  # expected overlap from which on all features are tried before giving up
CELLS = 8  # a side of the grid that spreads them


@dataclass(frozen=True)
class PhotoFeatures:
    xy: npt.NDArray[np.float32]  # (N, 2) undistorted photo pixels
    scale: npt.NDArray[np.float32]
    response: npt.NDArray[np.float32]
    descriptors: Descriptors


@dataclass(frozen=True)
class Edge:
    a: int
    b: int
    matches: Matches  # (M, 2) features of a and of b, all inliers of one homography


def match_pairs(
    pairs: Sequence[tuple[int, int]],
    features: Sequence[PhotoFeatures],
    priors: Sequence[Prior],
    ransac_px: float,
    on_progress: Callable[[float], None],
) -> list[Edge]:
    """The pairs that pass the paper's rule, in the order of `pairs`."""
    edges: list[Edge] = []
    workers = min(4, cpu_count() or 1)
    # Threads of the matrix products inside these would wait for one another, and burn as much time again.
    with threadpool_limits(1, "blas"), ThreadPoolExecutor(workers) as threads:
        found = threads.map(lambda pair: _match_pair(pair, features, priors, ransac_px), pairs)
        for count, edge in enumerate(found, start=1):
            if edge is not None:
                edges.append(edge)
            on_progress(count / len(pairs))
    return edges


def _match_pair(
    pair: tuple[int, int], features: Sequence[PhotoFeatures], priors: Sequence[Prior], ransac_px: float
) -> Edge | None:
    a, b = pair
    fa, fb = features[a], features[b]
    within_px = tolerance_px(priors[a].view.camera, ransac_px)
    in_a, sure_a = _expected_in(fa, priors[a], priors[b])
    in_b, sure_b = _expected_in(fb, priors[b], priors[a])
    camera = priors[b].view.camera
    likely = min(sure_a, sure_b) > LIKELY
    for most in (FEW, len(fa.xy) + len(fb.xy)) if likely else (FEW,):
        found = match(fa.descriptors[in_a[:most]], fb.descriptors[in_b[:most]])
        matches = np.column_stack([in_a[found[:, 0]], in_b[found[:, 1]]])
        verified = verify(fa.xy, fb.xy, matches, camera, within_px)
        if (verified is not None and verified.holds) or most >= max(len(in_a), len(in_b)):
            break
    if verified is None or not verified.holds:
        return None
    inliers = verified.inliers
    if len(inliers) < ENOUGH:  # look again, at all features, where the homography says
        predicted = transfer(verified.H, fa.xy.astype(np.float64))
        again = match_guided(fa.descriptors, fb.descriptors, predicted, fb.xy, 2.0 * within_px)
        more = verify(fa.xy, fb.xy, again, camera, within_px)
        if more is not None and len(more.inliers) > len(inliers):
            inliers = more.inliers
    return Edge(a, b, spread(inliers, fa.xy))


def _expected_in(features: PhotoFeatures, own: Prior, other: Prior) -> tuple[npt.NDArray[np.int64], float]:
    """The features that may lie in the other photo, and the share that does if the priors are right; all
    where the priors do not tell."""
    sigma = np.concatenate([own.sigma_position, other.sigma_position])
    if not np.isfinite([*sigma, own.sigma_rotation[2], other.sigma_rotation[2]]).all():
        return np.arange(len(features.xy)), 1.0
    swing = own.view.C[2] * float(np.hypot(own.sigma_rotation[:2].max(), other.sigma_rotation[:2].max()))
    margin_px = 3.0 * (float(np.hypot(sigma[:2].max(), sigma[3:5].max())) + swing) / other.view.units_per_px
    expected = other.view.to_undistorted(own.view.to_plane(features.xy))
    size = np.array([other.view.camera.width_px, other.view.camera.height_px])
    inside = ((expected > -margin_px) & (expected < size + margin_px)).all(axis=1)
    sure = int(((expected > 0) & (expected < size)).all(axis=1).sum())
    return np.flatnonzero(inside), sure / max(len(features.xy), 1)


def spread(matches: Matches, xy: npt.NDArray[np.float32]) -> Matches:
    """At most ENOUGH, the first of each cell of the overlap before the second of any; of a point with two
    directions, so with two features, the second last of all."""
    if len(matches) <= ENOUGH:
        return matches
    points = xy[matches[:, 0]]
    low, high = points.min(axis=0), points.max(axis=0)
    cell = ((points - low) / np.maximum(high - low, 1e-6) * (CELLS - 1e-3)).astype(int) @ np.array([1, CELLS])
    by_cell = np.argsort(cell, kind="stable")
    rank = np.empty(len(matches), int)
    rank[by_cell] = np.arange(len(matches)) - np.searchsorted(cell[by_cell], cell[by_cell])
    _, first = np.unique(points, axis=0, return_index=True)
    rank[np.setdiff1d(np.arange(len(matches)), first)] += len(matches)
    return matches[np.sort(np.argsort(rank, kind="stable")[:ENOUGH])]
