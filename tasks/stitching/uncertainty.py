"""How well an adjustment knows what it found: from its equations, and how its residuals hang together."""

from dataclasses import dataclass, replace

import numpy as np

from tasks.stitching.bundle import ON_SURFACE, PER_CAMERA, PER_PHOTO, Bundle, State, linearise
from tasks.stitching.normal_equations import reduced
from tasks.stitching.skyline import solve_positive
from tasks.stitching.tracks import Index
from tasks.stitching.view import Array

CELLS = (4, 3)  # across and down a photo: residuals within one err alike (relief, lens, shutter)
COSTLESS = 1e-3  # of what heights cost: so little that they hold nothing, and every block has an inverse
FEWEST = 4  # observations that make a cell's mean worth looking at


@dataclass(frozen=True)
class Certainty:
    """Covariances in squares of plane units."""

    relative: Array  # (n, 2, 2) of where a photo's middle lies, after the best similarity of all
    absolute: Array  # (n, 2, 2) of where it lies on the plane
    scale: float  # 1σ of the whole's scale, relative


def certainty_of(state: State, bundle: Bundle, weight: Array, trust: Array) -> Certainty:
    """Of the bundle's photos; weights as in the adjustment.

    How large the whole is heights do not tell, which are known relative to it: left to pull on it here, they
    would seem to. So the scale is told without what they cost."""
    middles, covariance = _covariance(state, bundle, weight, trust)
    told = covariance
    if bundle.spread != ON_SURFACE:
        free = bundle.spread._replace(determined=COSTLESS * bundle.spread.determined)
        _, told = _covariance(state, replace(bundle, spread=free), weight, trust)
    n, z = len(state.C), middles - middles.mean(axis=0)
    turn = np.stack([-z[:, 1], z[:, 0]], axis=1).ravel()
    gauge = np.stack([np.tile([1.0, 0.0], n), np.tile([0.0, 1.0], n), z.ravel(), turn], axis=1)
    gauge = gauge[:, (gauge**2).sum(axis=0) > 0]
    fit = np.linalg.pinv(gauge)
    rest = np.eye(2 * n) - gauge @ fit
    scale = (fit @ told @ fit.T)[2, 2] if gauge.shape[1] == 4 else 0.0
    return Certainty(
        _own_blocks(rest @ covariance @ rest.T), _own_blocks(covariance), float(np.sqrt(max(scale, 0.0)))
    )


def _covariance(state: State, bundle: Bundle, weight: Array, trust: Array) -> tuple[Array, Array]:
    """(n, 2) where the photos' middles lie, and (2n, 2n) of these."""
    residual, jacobians = linearise(state, bundle)
    system = reduced(state, bundle, residual, jacobians, weight, trust, 0.0)
    middles, J = _middles(state, bundle, len(system.g))
    return middles, J @ solve_positive(system.S, np.ascontiguousarray(J.T), bundle.shared)


def _own_blocks(covariance: Array) -> Array:
    n = len(covariance) // 2
    k = np.arange(n)
    return np.ascontiguousarray(covariance.reshape(n, 2, n, 2)[k, :, k, :])


def noise(bundle: Bundle, residual: Array, share: Array) -> float:
    """Variance (px²) of a coordinate of a fully trusted observation, as if all were independent: what they
    scatter within a cell of a photo, times how much more the cells' means scatter than that explains."""
    cell = bundle.photo * CELLS[0] * CELLS[1] + _cell(bundle)
    cells = int(cell.max()) + 1
    count = np.bincount(cell, minlength=cells)
    total = np.bincount(cell, share, minlength=cells)
    sums = np.stack([np.bincount(cell, share * r, minlength=cells) for r in residual.T], axis=1)
    mean = np.asarray(sums / np.maximum(total, 1e-12)[:, None], np.float64)
    used = count >= FEWEST
    if not used.any():
        return float((share * (residual**2).sum(axis=1)).sum() / (2 * share.sum()))
    off = share * ((residual - mean[cell]) ** 2).sum(axis=1)
    within = off[used[cell]].sum() / (2 * (count[used] - 1).sum())
    between = (total[used] * (mean[used] ** 2).sum(axis=1)).mean() / 2
    cells_of_photo = np.bincount(np.unique(cell[used[cell]]) // (CELLS[0] * CELLS[1]))
    free = 2.0 * cells_of_photo.sum()
    between *= free / max(free - PER_PHOTO * (cells_of_photo > 0).sum(), 0.1 * free)
    unknown = 2 * (int(bundle.track[-1]) + 1) + bundle.spread.determined  # points follow the residuals
    followed = residual.size / max(residual.size - unknown, 2)
    return float(max(within, between, 1e-12) * followed)


def _cell(bundle: Bundle) -> Index:
    size = np.array([(c.width_px, c.height_px) for c in bundle.cameras])[bundle.camera_of[bundle.photo]]
    at = np.clip(bundle.xy / size * np.array(CELLS), 0, np.array(CELLS) - 1e-6).astype(np.int64)
    return np.asarray(at[:, 0] + CELLS[0] * at[:, 1])


def _middles(state: State, bundle: Bundle, size: int) -> tuple[Array, Array]:
    """(n, 2) where the photos' middles meet the plane, and (2n, size) how that moves with all unknowns."""
    n = len(state.C)
    views = [bundle.view(state, k) for k in range(n)]
    X = np.stack([v.centre_uv for v in views])
    photo = np.arange(n)
    seen = replace(bundle, photo=photo, track=photo, xy=np.zeros((n, 2)), rolled=np.zeros(n))
    _, jacobians = linearise(replace(state, X=X, w=np.zeros(n)), seen)
    moves = -np.linalg.solve(jacobians.point[:, :, :2], jacobians.camera)
    J = np.zeros((n, 2, size))
    J[photo[:, None], :, PER_PHOTO * photo[:, None] + np.arange(PER_PHOTO)] = np.swapaxes(
        moves[:, :, :PER_PHOTO], 1, 2
    )
    lens = PER_PHOTO * n + PER_CAMERA * bundle.camera_of[:, None] + np.arange(PER_CAMERA)
    J[photo[:, None], :, lens] = np.swapaxes(moves[:, :, PER_PHOTO:], 1, 2)
    return X, J.reshape(2 * n, size)
