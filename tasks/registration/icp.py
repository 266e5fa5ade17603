"""Robust fine alignment: iterative closest point with a symmetric plane distance and Tukey's loss."""

from dataclasses import dataclass

import numba
import numpy as np

from tasks.registration.rigid_motion import Array, exp, orthonormal, transform
from tasks.registration.station_cloud import Cloud

TUKEY = 4.685  # 95 % efficient where errors are normal
LEAST_SCALE_M = 0.0005  # residuals are never taken for smaller than a scanner can measure
AGREEING_NORMALS = np.cos(np.radians(45))
ENOUGH = 30  # correspondences
STILL_M = 2e-5  # a step that moves the points by less ends the last round,
NEARLY_STILL_M = 5e-4  # and one before it
SAME_PARTNERS_M = 1e-3  # moved by less since they were looked up, points keep their partners
FIRST_SHARE = 4  # one point of so many is enough for the first round


@dataclass(frozen=True)
class Alignment:
    T_target_source: Array
    rmse_m: float  # of the inliers' plane distances
    inliers: int
    information: Array  # (6, 6) JᵀWJ of the inliers, for ξ applied on the left (target frame); m⁻² scale 1


@dataclass(frozen=True)
class _Partners:
    """(N, 3) source points and normals in the source frame, and their partners in the target frame."""

    p: Array
    n_p: Array
    q: Array
    n_q: Array


def align(
    source: Cloud, target: Cloud, T_target_source: Array, reach_m: tuple[float, ...], iterations: int = 15
) -> Alignment | None:
    """Move the source onto the target.

    The distance of a pair is measured along the sum of both normals (symmetric ICP, Rusinkiewicz 2019),
    which is exact on curved parts too, and weighted by Tukey's biweight. `reach_m`: how far a partner may
    be, one value a round, coarse to fine. A round cuts off at its reach, so that the few surfaces that hold
    a direction are not taken for outliers while they are still far off; the last one is followed by a round
    that cuts off by the residuals' own scale. None where fewer than 30 partners are found.
    """
    some = source.taken(np.arange(0, len(source), FIRST_SHARE))
    rounds = [(source, reach, reach) for reach in reach_m] + [(source, reach_m[-1], 0.0)]
    if len(reach_m) > 1 and len(some) >= 10 * ENOUGH:
        rounds[0] = (some, reach_m[0], reach_m[0])
    T = T_target_source
    found = None
    for moving, reach, cutoff_m in rounds:
        found = _round(moving, target, T, reach, cutoff_m, iterations)
        if found is None:
            return None
        T = found.T_target_source
    return found


def _round(
    source: Cloud, target: Cloud, T: Array, reach_m: float, cutoff_m: float, iterations: int
) -> Alignment | None:
    """Gauss-Newton; cutoff 0: from the residuals."""
    size_m = float(np.sqrt((transform(T, source.points_m) ** 2).sum(axis=1).mean()))
    partners: _Partners | None = None
    moved_m = 0.0  # since the partners were looked up
    found = None
    for _ in range(iterations):
        if partners is None or moved_m > SAME_PARTNERS_M:
            partners, moved_m = _partners(source, target, T, reach_m), 0.0
            if partners is None:
                return None
        moved, normal, residual = _residuals(partners.p, partners.n_p, partners.q, partners.n_q, T)
        cutoff = cutoff_m or TUKEY * max(1.4826 * float(np.median(np.abs(residual))), LEAST_SCALE_M)
        A, b, square, inliers = _normal_equations(moved, normal, residual, cutoff)
        if inliers == 0:
            return None
        xi = np.linalg.solve(A + 1e-9 * np.trace(A) * np.eye(6), b)
        T = orthonormal(exp(xi) @ T)
        found = Alignment(T, float(np.sqrt(square / inliers)), inliers, A)
        step_m = float(np.linalg.norm(xi[3:]) + np.linalg.norm(xi[:3]) * size_m)
        moved_m += step_m
        if step_m < (NEARLY_STILL_M if cutoff_m else STILL_M):
            break
    return found


def _partners(source: Cloud, target: Cloud, T: Array, reach_m: float) -> _Partners | None:
    """Nearest neighbours within reach whose surfaces face the same way; None where there are too few."""
    distance_m, nearest = target.nearest(transform(T, source.points_m), reach_m)
    near = np.flatnonzero(np.isfinite(distance_m))
    nearest = nearest[near]
    n_target = target.normals[nearest]
    same = np.einsum("ij,ij->i", source.normals[near] @ T[:3, :3].T, n_target) > AGREEING_NORMALS
    if same.sum() < ENOUGH:
        return None
    at = near[same]
    return _Partners(
        source.points_m[at].astype(np.float64),
        source.normals[at].astype(np.float64),
        target.points_m[nearest[same]].astype(np.float64),
        n_target[same].astype(np.float64),
    )


@numba.njit(cache=True)
def _residuals(p: Array, n_p: Array, q: Array, n_q: Array, T: Array) -> tuple[Array, Array, Array]:
    """(N, 3) moved points, (N, 3) the pairs' directions, (N,) distances along them."""
    moved = np.empty_like(p)
    normal = np.empty_like(p)
    residual = np.empty(len(p))
    for k in range(len(p)):
        length = 0.0
        for i in range(3):
            moved[k, i] = T[i, 0] * p[k, 0] + T[i, 1] * p[k, 1] + T[i, 2] * p[k, 2] + T[i, 3]
            n = T[i, 0] * n_p[k, 0] + T[i, 1] * n_p[k, 1] + T[i, 2] * n_p[k, 2] + n_q[k, i]
            normal[k, i] = n
            length += n * n
        length = np.sqrt(length)
        distance = 0.0
        for i in range(3):
            normal[k, i] /= length
            distance += (moved[k, i] - q[k, i]) * normal[k, i]
        residual[k] = distance
    return moved, normal, residual


@numba.njit(cache=True)
def _normal_equations(
    moved: Array, normal: Array, residual: Array, cutoff_m: float
) -> tuple[Array, Array, float, int]:
    """JᵀWJ (6, 6), −JᵀWr (6,), sum of the inliers' squares, number of inliers."""
    A = np.zeros((6, 6))
    b = np.zeros(6)
    J = np.empty(6)
    square = 0.0
    inliers = 0
    for k in range(len(residual)):
        u = residual[k] / cutoff_m
        if abs(u) >= 1.0:
            continue
        weight = (1.0 - u * u) ** 2
        inliers += 1
        square += residual[k] ** 2
        J[0] = moved[k, 1] * normal[k, 2] - moved[k, 2] * normal[k, 1]
        J[1] = moved[k, 2] * normal[k, 0] - moved[k, 0] * normal[k, 2]
        J[2] = moved[k, 0] * normal[k, 1] - moved[k, 1] * normal[k, 0]
        J[3], J[4], J[5] = normal[k, 0], normal[k, 1], normal[k, 2]
        for i in range(6):
            b[i] -= weight * residual[k] * J[i]
            for j in range(i + 1):
                A[i, j] += weight * J[i] * J[j]
    for i in range(6):
        for j in range(i):
            A[j, i] = A[i, j]
    return A, b, square, inliers
