"""Robust fine alignment: iterative closest point with a symmetric plane distance and Tukey's loss."""

from dataclasses import dataclass

import numpy as np

from tasks.registration.rigid_motion import Array, exp, orthonormal, transform
from tasks.registration.station_cloud import Cloud

TUKEY = 4.685  # 95 % efficient where errors are normal
LEAST_SCALE_M = 0.0005  # residuals are never taken for smaller than a scanner can measure
AGREEING_NORMALS = np.cos(np.radians(45))
ENOUGH = 30  # correspondences
STILL_RAD, STILL_M = 2e-6, 2e-5  # a step below both ends a round


@dataclass(frozen=True)
class Alignment:
    T_target_source: Array
    rmse_m: float  # of the inliers' plane distances
    inliers: int
    information: Array  # (6, 6) JᵀWJ of the inliers, for ξ applied on the left (target frame); m⁻² scale 1


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
    T = T_target_source
    rounds = [(reach, reach) for reach in reach_m] + [(reach_m[-1], 0.0)]
    for reach, cutoff_m in rounds:
        for _ in range(iterations):
            found = _step(source, target, T, reach, cutoff_m)
            if found is None:
                return None
            xi, information, rmse_m, inliers = found
            T = orthonormal(exp(xi) @ T)
            if np.linalg.norm(xi[:3]) < STILL_RAD and np.linalg.norm(xi[3:]) < STILL_M:
                break
    return Alignment(T, rmse_m, inliers, information)


def _step(
    source: Cloud, target: Cloud, T: Array, reach_m: float, cutoff_m: float
) -> tuple[Array, Array, float, int] | None:
    """ξ, information, RMSE and inliers; cutoff 0: from the residuals."""
    moved = transform(T, source.points_m)
    distance_m, nearest = target.nearest(moved, reach_m)
    near = np.flatnonzero(np.isfinite(distance_m))
    nearest = nearest[near]
    n_source = source.normals[near] @ T[:3, :3].T
    n_target = target.normals[nearest]
    same = np.einsum("ij,ij->i", n_source, n_target) > AGREEING_NORMALS
    if same.sum() < ENOUGH:
        return None
    p, q = moved[near[same]], target.points_m[nearest[same]].astype(np.float64)
    n = n_source[same] + n_target[same]
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    residual = np.einsum("ij,ij->i", p - q, n)
    if cutoff_m == 0.0:
        cutoff_m = TUKEY * max(1.4826 * float(np.median(np.abs(residual))), LEAST_SCALE_M)
    u = residual / cutoff_m
    weight = np.where(np.abs(u) < 1, (1 - u * u) ** 2, 0.0)
    J = np.hstack([np.cross(p, n), n])
    A = J.T @ (J * weight[:, None])
    b = -J.T @ (weight * residual)
    xi = np.linalg.solve(A + 1e-9 * np.trace(A) * np.eye(6), b)
    inliers = weight > 0
    rmse_m = float(np.sqrt(np.mean(residual[inliers] ** 2)))
    return xi, A, rmse_m, int(inliers.sum())
