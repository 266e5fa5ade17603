"""Rigid motions as (4, 4) matrices, and their six small parameters ξ = (ω, v): radians first, then metres."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def transform(T: Array, points_m: npt.NDArray[np.floating]) -> Array:
    """(N, 3) float64 points moved by T."""
    return np.asarray(points_m @ T[:3, :3].T + T[:3, 3], dtype=np.float64)


def inverse(T: Array) -> Array:
    R_t = T[:3, :3].T
    return pose(R_t, -R_t @ T[:3, 3])


def pose(R: npt.ArrayLike, t: npt.ArrayLike) -> Array:
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = t
    return T


def yaw(angle_rad: float, t: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Turn about z (up), counter-clockwise seen from above, then shift by t."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return pose([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], t)


def skew(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def exp(xi: Array) -> Array:
    """T of ξ = (ω, v); the exponential map of SE(3)."""
    w, v = xi[:3], xi[3:]
    angle = float(np.linalg.norm(w))
    W = skew(w)
    if angle < 1e-9:
        return pose(np.eye(3) + W, v)
    a = np.sin(angle) / angle
    b = (1 - np.cos(angle)) / angle**2
    c = (1 - a) / angle**2
    return pose(np.eye(3) + a * W + b * W @ W, (np.eye(3) + b * W + c * W @ W) @ v)


def log(T: Array) -> Array:
    """ξ of T; inverse of `exp` for rotations below 180°."""
    R = T[:3, :3]
    angle = float(np.arctan2(np.linalg.norm(_vee(R)), np.trace(R) - 1))
    w = _vee(R) / 2 if angle < 1e-9 else _vee(R) * angle / (2 * np.sin(angle))
    W = skew(w)
    if angle < 1e-4:
        V_inverse = np.eye(3) - W / 2 + W @ W / 12
    else:
        half = angle / 2
        V_inverse = np.eye(3) - W / 2 + W @ W * (1 - half / np.tan(half)) / angle**2
    return np.concatenate([w, V_inverse @ T[:3, 3]])


def adjoint(T: Array) -> Array:
    """(6, 6): T exp(ξ) T⁻¹ = exp(Ad ξ)."""
    A = np.zeros((6, 6))
    A[:3, :3] = A[3:, 3:] = T[:3, :3]
    A[3:, :3] = skew(T[:3, 3]) @ T[:3, :3]
    return A


def angle_deg(T: Array) -> float:
    """How far T turns."""
    R = T[:3, :3]
    return float(np.degrees(np.arctan2(np.linalg.norm(_vee(R)), np.trace(R) - 1)))


def fit(source_m: Array, target_m: Array, weights: Array | None = None) -> Array:
    """T_target_source that brings (N, 3) points onto their partners by least squares (Kabsch 1976)."""
    w = np.full(len(source_m), 1 / len(source_m)) if weights is None else weights / weights.sum()
    source_mean, target_mean = w @ source_m, w @ target_m
    covariance = (source_m - source_mean).T @ ((target_m - target_mean) * w[:, None])
    U, _, Vt = np.linalg.svd(covariance)
    turn = np.diag([1.0, 1.0, np.sign(np.linalg.det(Vt.T @ U.T))])
    R = Vt.T @ turn @ U.T
    return pose(R, target_mean - R @ source_mean)


def orthonormal(T: Array) -> Array:
    """T with the rounding of many products taken off its rotation."""
    U, _, Vt = np.linalg.svd(T[:3, :3])
    return pose(U @ Vt, T[:3, 3])


def _vee(R: Array) -> Array:
    """2 sin(angle) times the axis."""
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
