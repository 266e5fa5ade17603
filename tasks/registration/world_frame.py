"""The world frame: where the stations' poses lie among the positions and poses that the crew stated.

Scanners are levelled, so z stays up: positions decide on yaw and shift alone. A statement that contradicts
the others (a typing error of ten metres) is outvoted.
"""

from collections.abc import Sequence

import numpy as np

from tasks.registration.rigid_motion import Array, inverse, pose, transform, yaw

AGREE_M = 0.5  # a statement within this of the fit is taken to be meant
AGREE_DEG = 10.0
SHORTEST_BASELINE_M = 1.0  # positions closer than this fix no yaw


def fit(
    T_frame_local: Sequence[Array],
    prior_T_world_local: Sequence[Array | None],
    scanner_m: Sequence[Array | None],
    position_m: Sequence[Array | None],
) -> Array | None:
    """(4, 4) T_world_frame, or None where the statements do not fix a yaw.

    T_frame_local: poses found by registration; the others as in `Site`, one per station. The hypothesis
    with the most agreeing stations wins (the earlier one of equals), then the positions of these are fitted
    by least squares in yaw and shift.
    """
    stations = range(len(T_frame_local))
    posed = [(i, prior) for i in stations if (prior := prior_T_world_local[i]) is not None]
    measured = [
        (transform(T_frame_local[i], scanner[None])[0], position)
        for i in stations
        if (scanner := scanner_m[i]) is not None and (position := position_m[i]) is not None
    ]
    hypotheses = [prior @ inverse(T_frame_local[i]) for i, prior in posed]
    for k, (frame_k, world_k) in enumerate(measured):
        for frame_l, world_l in measured[:k]:
            two = fit_yaw(np.array([frame_l, frame_k]), np.array([world_l, world_k]))
            if two is not None:
                hypotheses.append(two)
    if not hypotheses:
        return None

    def votes(T: Array) -> tuple[int, float]:
        errors_m = [float(np.linalg.norm(transform(T, f[None])[0] - w)) for f, w in measured]
        poses = sum(_agree(T @ T_frame_local[i], prior) for i, prior in posed)
        near = [e for e in errors_m if e < AGREE_M]
        return len(near) + poses, -sum(near)

    best = max(hypotheses, key=votes)
    near = [(f, w) for f, w in measured if np.linalg.norm(transform(best, f[None])[0] - w) < AGREE_M]
    if len(near) >= 2:
        frame_m = transform(best, np.array([f for f, _ in near]))
        correction = fit_yaw(frame_m, np.array([w for _, w in near]))
        if correction is not None:
            best = correction @ best
    return best


def shift_only(frame_m: Array, world_m: Array) -> Array:
    """T_world_frame where one position is known and no yaw: the first scan's axes stay."""
    return pose(np.eye(3), world_m - frame_m)


def levelled(T_frame_local: Sequence[Array]) -> Array:
    """(4, 4) the small turn that puts the mean z axis of levelled scanners upright; identity where they are
    not levelled (their z axes differ by more than 1°)."""
    axes = np.array([T[:3, 2] for T in T_frame_local])
    up = axes.mean(axis=0)
    up /= np.linalg.norm(up)
    if (axes @ up).min() < np.cos(np.radians(1.0)):
        return np.eye(4)
    turn = np.cross(up, [0.0, 0.0, 1.0])
    W = np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]])
    return pose(np.eye(3) + W + W @ W / (1 + up[2]), np.zeros(3))


def fit_yaw(frame_m: Array, world_m: Array) -> Array | None:
    """Least squares in yaw and shift of (N, 3) positions; None where they stand too close together."""
    frame_mean, world_mean = frame_m.mean(axis=0), world_m.mean(axis=0)
    f, w = frame_m - frame_mean, world_m - world_mean
    if (
        min(np.linalg.norm(f[:, :2], axis=1).max(), np.linalg.norm(w[:, :2], axis=1).max()) * 2
        < SHORTEST_BASELINE_M
    ):
        return None
    angle = np.arctan2((f[:, 0] * w[:, 1] - f[:, 1] * w[:, 0]).sum(), (f[:, :2] * w[:, :2]).sum())
    T = yaw(float(angle))
    T[:3, 3] = world_mean - T[:3, :3] @ frame_mean
    return T


def _agree(T: Array, prior: Array) -> bool:
    apart = inverse(prior) @ T
    turned = np.degrees(np.arccos(np.clip((np.trace(apart[:3, :3]) - 1) / 2, -1, 1)))
    return bool(turned < AGREE_DEG and np.linalg.norm(T[:3, 3] - prior[:3, 3]) < AGREE_M)
