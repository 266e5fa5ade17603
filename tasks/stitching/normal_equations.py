"""One step of the adjustment: tracks are eliminated (Schur complement; Triggs et al. 2000, section 6), what
remains of the photos is a banded system bordered by the shared unknowns."""

from dataclasses import dataclass

import numba
import numpy as np

from tasks.stitching.bundle import (
    ALIKE,
    PER_CAMERA,
    PER_PHOTO,
    Bundle,
    Jacobians,
    State,
    height_weight,
    nominal_lens,
    prior_errors,
    sigma_lens,
)
from tasks.stitching.skyline import solve_positive
from tasks.stitching.tracks import Index
from tasks.stitching.view import Array, rotation


@dataclass(frozen=True)
class Reduced:
    """S d = −g of the photos and the shared unknowns, tracks eliminated; and what gives the tracks back."""

    S: Array  # (size, size)
    g: Array  # (size,)
    columns: Index  # (M, 12) unknowns that each observation touches
    mixed: Array  # (M, 3, 12) and how its track hangs together with them
    H_inverse: Array  # (tracks, 3, 3)
    h: Array  # (tracks, 3)


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
    camera = jacobians.camera
    columns = np.concatenate(
        [
            PER_PHOTO * bundle.photo[:, None] + np.arange(PER_PHOTO),
            PER_PHOTO * n + PER_CAMERA * bundle.camera_of[bundle.photo][:, None] + np.arange(PER_CAMERA),
        ],
        axis=1,
    )
    A, g, mixed = np.zeros((size, size)), np.zeros(size), np.empty((len(camera), 3, camera.shape[2]))
    _add_observations(A, g, mixed, columns, camera, jacobians.point, residual, weight)
    _add_priors(A, g, state, bundle, trust)
    A[np.diag_indices(size)] *= 1.0 + damping
    # What no observation and no prior tells stays as it is: a photo whose last point was thrown out.
    tiny = np.where(np.diag(A) > 0.0, 1e-12 * np.diag(A), 1.0)

    H_inverse, h = point_blocks(state, bundle, jacobians.point, weight, residual, damping)
    half = np.zeros_like(A)
    _eliminate(half, g, columns, mixed, bundle.track, H_inverse, h)
    S = A - half - half.T
    S[np.diag_indices(size)] += tiny
    return Reduced(S, g, columns, mixed, H_inverse, h)


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
    pose, lens = d[: PER_PHOTO * n].reshape(n, PER_PHOTO), d[PER_PHOTO * n : size - 3].reshape(-1, PER_CAMERA)
    back = -system.h - _pulled(system.mixed, d, system.columns, bundle.track, len(state.X))
    moved = np.einsum("tij,tj->ti", system.H_inverse, back)
    return State(
        R=state.R @ rotation(pose[:, :3]),
        C=state.C + pose[:, 3:6],
        roll=state.roll + pose[:, 6:],
        lens=state.lens + lens,
        bias=state.bias + d[size - 3 :],
        X=state.X + moved[:, :2],
        w=state.w + moved[:, 2],
    )


@numba.njit(cache=True, nogil=True)
def _add_observations(
    A: Array,
    g: Array,
    mixed: Array,
    columns: Index,
    camera: Array,
    point: Array,
    residual: Array,
    weight: Array,
) -> None:
    """Into A and g, points held; and `mixed`, all in place."""
    width = camera.shape[2]
    for m in range(len(weight)):
        x, y = weight[m] * camera[m, 0], weight[m] * camera[m, 1]
        own, lens = columns[m, 0], columns[m, PER_PHOTO]
        for i in range(width):
            row = A[columns[m, i]]
            for j in range(PER_PHOTO):
                row[own + j] += x[i] * camera[m, 0, j] + y[i] * camera[m, 1, j]
            for j in range(PER_PHOTO, width):
                row[lens + j - PER_PHOTO] += x[i] * camera[m, 0, j] + y[i] * camera[m, 1, j]
            g[columns[m, i]] += x[i] * residual[m, 0] + y[i] * residual[m, 1]
            for k in range(3):
                mixed[m, k, i] = point[m, 0, k] * x[i] + point[m, 1, k] * y[i]


@numba.njit(cache=True, nogil=True)
def _eliminate(
    half: Array, g: Array, columns: Index, mixed: Array, track: Index, H_inverse: Array, h: Array
) -> None:
    """Take the tracks out of g and add what they take out of A to half + halfᵀ; observations are sorted by
    track. Of the columns, a photo's own and its camera's each follow one another: runs that vectorise."""
    width = columns.shape[1]
    Y = np.empty((3, width))
    for m in range(len(track)):
        t = track[m]
        for i in range(width):
            for k in range(3):
                Y[k, i] = (
                    H_inverse[t, k, 0] * mixed[m, 0, i]
                    + H_inverse[t, k, 1] * mixed[m, 1, i]
                    + H_inverse[t, k, 2] * mixed[m, 2, i]
                )
            g[columns[m, i]] -= Y[0, i] * h[t, 0] + Y[1, i] * h[t, 1] + Y[2, i] * h[t, 2]
        for other in range(m, len(track)):
            if track[other] != t:
                break
            share = 0.5 if other == m else 1.0
            own, lens = columns[other, 0], columns[other, PER_PHOTO]
            for i in range(width):
                row, a, b, c = half[columns[m, i]], share * Y[0, i], share * Y[1, i], share * Y[2, i]
                for j in range(PER_PHOTO):
                    row[own + j] += a * mixed[other, 0, j] + b * mixed[other, 1, j] + c * mixed[other, 2, j]
                for j in range(PER_CAMERA):
                    k = PER_PHOTO + j
                    row[lens + j] += a * mixed[other, 0, k] + b * mixed[other, 1, k] + c * mixed[other, 2, k]


@numba.njit(cache=True, nogil=True)
def _pulled(mixed: Array, d: Array, columns: Index, track: Index, tracks: int) -> Array:
    """(tracks, 3) of what a step d of the photos and the shared unknowns does to the tracks' equations."""
    pulled = np.zeros((tracks, 3))
    for m in range(len(track)):
        for i in range(columns.shape[1]):
            for k in range(3):
                pulled[track[m], k] += mixed[m, k, i] * d[columns[m, i]]
    return pulled


def point_blocks(
    state: State, bundle: Bundle, point: Array, weight: Array, residual: Array, damping: float
) -> tuple[Array, Array]:
    """(T, 3, 3) inverse damped blocks and (T, 3) gradients of the points."""
    blocks, pulls = np.zeros((len(state.X), 3, 3)), np.zeros((len(state.X), 3))
    _add_points(blocks, pulls, point, weight, residual, bundle.track)
    held = height_weight(state, bundle)
    blocks[:, 2, 2] += held
    pulls[:, 2] += held * state.w
    blocks[:, range(3), range(3)] *= 1.0 + damping
    return np.asarray(np.linalg.inv(blocks), np.float64), pulls


@numba.njit(cache=True, nogil=True)
def _add_points(
    blocks: Array, pulls: Array, point: Array, weight: Array, residual: Array, track: Index
) -> None:
    """In place: what every observation says of its track."""
    for m in range(len(track)):
        t = track[m]
        for i in range(3):
            x, y = weight[m] * point[m, 0, i], weight[m] * point[m, 1, i]
            pulls[t, i] += x * residual[m, 0] + y * residual[m, 1]
            for j in range(3):
                blocks[t, i, j] += x * point[m, 0, j] + y * point[m, 1, j]


def _add_priors(A: Array, g: Array, state: State, bundle: Bundle, trust: Array) -> None:
    """Into the normal equations A d = −g, in place."""
    n, size = len(state.C), len(g)
    turned, moved = prior_errors(state, bundle)
    position = bundle.weight_position * trust[:, None]
    own = PER_PHOTO * np.arange(n)[:, None] + np.arange(PER_PHOTO)
    rolling = np.broadcast_to(bundle.sigma_roll**-2.0, (n, 2))
    weight = np.concatenate([bundle.weight_rotation, position, rolling], axis=1)
    A[own, own] += weight
    g[own] += weight * np.concatenate([turned, moved, state.roll - bundle.expected_roll], axis=1)
    g[own[:, 5]] -= bundle.spread.determined / ALIKE / state.C[:, 2].sum()  # see adjustment._cost
    bias = np.arange(size - 3, size)
    A[own[:, 3:6], bias] -= position
    A[bias, own[:, 3:6]] -= position
    A[bias, bias] += bundle.weight_bias + position.sum(axis=0)
    g[bias] += bundle.weight_bias * state.bias - (position * moved).sum(axis=0)
    lens, lens_weight = np.arange(PER_PHOTO * n, size - 3), sigma_lens(bundle) ** -2.0
    A[lens, lens] += lens_weight.ravel()
    g[lens] += (lens_weight * (state.lens - nominal_lens(bundle.cameras))).ravel()
