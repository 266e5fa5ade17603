"""One step of the adjustment: tracks are eliminated (Schur complement; Triggs et al. 2000, section 6), what
remains of the photos is a banded system bordered by the shared unknowns."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from tasks.stitching.bundle import PER_PHOTO, Bundle, Jacobians, State, nominal_k1, prior_errors, sigma_k1
from tasks.stitching.skyline import solve_positive
from tasks.stitching.tracks import Index
from tasks.stitching.view import Array, rotation


@dataclass(frozen=True)
class Reduced:
    """S d = −g of the photos and the shared unknowns, tracks eliminated; and what gives the tracks back."""

    S: Array  # (size, size)
    g: Array  # (size,)
    E: csr_matrix  # (size, 2 tracks) photos against tracks
    H_inverse: Array  # (tracks, 2, 2)
    h: Array  # (tracks, 2)


def reduced(
    state: State,
    bundle: Bundle,
    residual: Array,
    jacobians: Jacobians,
    weight: Array,
    trust: Array,
    damping: float,
) -> Reduced:
    """weight: (M,) of the observations, 1/px²; trust: (n,) factors on the weights of the prior positions."""
    n, size = len(state.C), PER_PHOTO * len(state.C) + bundle.shared
    camera = np.concatenate([jacobians.pose, jacobians.lens], axis=2)  # (M, 2, 10)
    columns = np.concatenate(
        [
            PER_PHOTO * bundle.photo[:, None] + np.arange(PER_PHOTO),
            PER_PHOTO * n + 2 * bundle.camera_of[bundle.photo][:, None] + np.arange(2),
        ],
        axis=1,
    )  # (M, 10) unknowns that each observation touches
    weighted = camera * weight[:, None, None]
    A, g = _photo_blocks(weighted, camera, residual, columns, size)
    _add_priors(A, g, state, bundle, trust)
    A[np.diag_indices(size)] *= 1.0 + damping

    H_inverse, h = _point_blocks(jacobians.point, weight, residual, bundle.track, len(state.X), damping)
    mixed = np.swapaxes(weighted, 1, 2) @ jacobians.point  # (M, 10, 2)
    place = np.broadcast_to(columns[:, :, None], mixed.shape).ravel()
    point = np.broadcast_to(2 * bundle.track[:, None, None] + np.arange(2), mixed.shape).ravel()
    shape = (size, 2 * len(state.X))
    E = coo_matrix((mixed.ravel(), (place, point)), shape=shape).tocsr()
    Y = coo_matrix(((mixed @ H_inverse[bundle.track]).ravel(), (place, point)), shape=shape).tocsr()
    S = A - (Y @ E.T).toarray()
    S = (S + S.T) / 2 + 1e-12 * np.diag(np.diag(A))
    return Reduced(S, g - Y @ h.ravel(), E, H_inverse, h)


def damped_step(
    state: State,
    bundle: Bundle,
    residual: Array,
    jacobians: Jacobians,
    weight: Array,
    trust: Array,
    damping: float,
) -> State:
    """The state after one damped Gauss-Newton step; arguments as in `reduced`."""
    n, size = len(state.C), PER_PHOTO * len(state.C) + bundle.shared
    system = reduced(state, bundle, residual, jacobians, weight, trust, damping)
    d = solve_positive(system.S, -system.g, bundle.shared)
    pose, lens = d[: PER_PHOTO * n].reshape(n, PER_PHOTO), d[PER_PHOTO * n : size - 3].reshape(-1, 2)
    back = -system.h - (system.E.T @ d).reshape(-1, 2)
    return State(
        R=state.R @ rotation(pose[:, :3]),
        C=state.C + pose[:, 3:6],
        roll=state.roll + pose[:, 6:],
        log_focal=state.log_focal + lens[:, 0],
        k1=state.k1 + lens[:, 1],
        bias=state.bias + d[size - 3 :],
        X=state.X + np.einsum("tij,tj->ti", system.H_inverse, back),
    )


def _photo_blocks(
    weighted: Array, camera: Array, residual: Array, columns: Index, size: int
) -> tuple[Array, Array]:
    """A (size, size) and g (size,) of the observations, points held."""
    blocks = np.swapaxes(weighted, 1, 2) @ camera
    rows = np.broadcast_to(columns[:, :, None], blocks.shape).ravel()
    across = np.broadcast_to(columns[:, None, :], blocks.shape).ravel()
    A = coo_matrix((blocks.ravel(), (rows, across)), shape=(size, size)).toarray()
    pulls = np.einsum("mki,mk->mi", weighted, residual).ravel()
    return A, np.bincount(columns.ravel(), pulls, minlength=size).astype(np.float64)


def _point_blocks(
    point: Array, weight: Array, residual: Array, track: Index, tracks: int, damping: float
) -> tuple[Array, Array]:
    """(T, 2, 2) inverse damped blocks and (T, 2) gradients of the points."""
    blocks = np.einsum("mki,mkj,m->mij", point, point, weight).reshape(-1, 4)
    a, b, _, d = (np.bincount(track, blocks[:, k], minlength=tracks).astype(np.float64) for k in range(4))
    a, d = a * (1.0 + damping), d * (1.0 + damping)
    inverse = np.stack([d, -b, -b, a], axis=1) / (a * d - b * b)[:, None]
    pulls = np.einsum("mki,mk,m->mi", point, residual, weight)
    h = [np.bincount(track, pulls[:, k], minlength=tracks).astype(np.float64) for k in range(2)]
    return inverse.reshape(-1, 2, 2), np.stack(h, axis=1)


def _add_priors(A: Array, g: Array, state: State, bundle: Bundle, trust: Array) -> None:
    """Into the normal equations A d = −g, in place."""
    n, size = len(state.C), len(g)
    turned, moved = prior_errors(state, bundle)
    position = bundle.weight_position * trust[:, None]
    own = PER_PHOTO * np.arange(n)[:, None] + np.arange(PER_PHOTO)
    rolling = np.broadcast_to(bundle.sigma_roll**-2.0, (n, 2))
    weight = np.concatenate([bundle.weight_rotation, position, rolling], axis=1)
    A[own, own] += weight
    g[own] += weight * np.concatenate([turned, moved, state.roll], axis=1)
    bias = np.arange(size - 3, size)
    A[own[:, 3:6], bias] -= position
    A[bias, own[:, 3:6]] -= position
    A[bias, bias] += bundle.weight_bias + position.sum(axis=0)
    g[bias] += bundle.weight_bias * state.bias - (position * moved).sum(axis=0)
    focal = PER_PHOTO * n + 2 * np.arange(len(bundle.cameras))
    A[focal, focal] += bundle.sigma_log_focal**-2.0
    g[focal] += state.log_focal * bundle.sigma_log_focal**-2.0
    k1_weight = sigma_k1(bundle) ** -2.0
    A[focal + 1, focal + 1] += k1_weight
    g[focal + 1] += k1_weight * (state.k1 - nominal_k1(bundle))
