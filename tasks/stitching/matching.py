"""Match the features of two photos: nearest neighbours, ratio test, mutual (Lowe 2004)."""

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from tasks.stitching.view import Array

RATIO = 0.85  # of distances; RootSIFT's are closer together than SIFT's
FARTHEST = 0.75  # between unit descriptors; 1.41 is unrelated
UNIT = 512.0  # length of a stored descriptor

Descriptors = npt.NDArray[np.uint8]
Matches = npt.NDArray[np.int64]  # (M, 2) feature of a, feature of b


def match(a: Descriptors, b: Descriptors) -> Matches:
    """Exact: products of 8-bit integers in float32 sum below 2²⁴, so the order of sums changes nothing."""
    if len(a) < 2 or len(b) < 2:
        return np.zeros((0, 2), np.int64)
    similarity = a.astype(np.float32) @ b.astype(np.float32).T
    best_in_b = similarity.argmax(axis=1)
    best_in_a = similarity.argmax(axis=0)
    rows = np.arange(len(a))
    best = similarity[rows, best_in_b]
    similarity[rows, best_in_b] = -1.0
    second_in_b = similarity.argmax(axis=1)
    near = _distance(a, b[best_in_b], best)
    far = _distance(a, b[second_in_b], similarity[rows, second_in_b])
    good = (best_in_a[best_in_b] == rows) & (near < RATIO * far) & (near < FARTHEST)
    return np.column_stack([rows[good], best_in_b[good]])


def match_guided(
    a: Descriptors, b: Descriptors, predicted_b: Array, xy_b: npt.NDArray[np.float32], radius_px: float
) -> Matches:
    """The most similar feature of b within `radius_px` of where each feature of a is expected, one place or
    several, (N, 2) or (N, K, 2); mutual."""
    if len(a) == 0 or len(b) == 0:
        return np.zeros((0, 2), np.int64)
    expected = np.nan_to_num(predicted_b, nan=-1e9)
    k = min(4, len(b))
    _, near = cKDTree(xy_b).query(expected, k=k, distance_upper_bound=radius_px)
    near = near.reshape(len(a), -1)
    there = near < len(b)
    candidates = b[np.where(there, near, 0)].astype(np.float32)
    similarity = np.where(there, np.einsum("nd,nkd->nk", a.astype(np.float32), candidates), -1.0)
    choice = similarity.argmax(axis=1)
    rows = np.arange(len(a))
    best, chosen = similarity[rows, choice], near[rows, choice]
    good = (best >= 0) & (_distance(a, b[np.where(best >= 0, near[rows, choice], 0)], best) < FARTHEST)
    rows, chosen, best = rows[good], chosen[good], best[good]
    order = np.lexsort((rows, -best, chosen))  # of several that chose one, the most similar keeps it
    keep = np.ones(len(order), bool)
    keep[1:] = chosen[order][1:] != chosen[order][:-1]
    kept = np.sort(order[keep])
    return np.column_stack([rows[kept], chosen[kept]])


def _distance(a: Descriptors, b: Descriptors, product: npt.NDArray[np.float32]) -> Array:
    squares = _square(a) + _square(b) - 2.0 * product
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / UNIT)


def _square(a: Descriptors) -> Array:
    return np.asarray((a.astype(np.float64) ** 2).sum(axis=1))
