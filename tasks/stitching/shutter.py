"""What a rolling shutter does to photos, as the photos themselves tell it, and the vehicle's speed at each.

In photos that are all upright, what the shutter did to all of them alike is a stretch and a slant of the
whole, which no photo tells of: what the vehicle moved by while a photo was read out does."""

import numpy as np

from tasks.stitching.bundle import PER_PHOTO, Bundle, State, linearise
from tasks.stitching.normal_equations import reduced
from tasks.stitching.skyline import solve_positive
from tasks.stitching.view import Array

LEAST_ROLL_PX = 0.02  # 1σ; less cannot be told from none
NO_ROLL = np.full(2, LEAST_ROLL_PX)
LONGEST_S = 0.2  # from the first row's exposure to the last one's: no camera takes longer


def expected_roll(state: State, bundle: Bundle) -> Array:
    """(n, 2) pixels that the vehicle's speed moves each photo's last row by against its first; 0 where the
    speed of a photo is not known, or where the rolls found do not follow it.

    The time of reading out is what fits how the rolls found differ from photo to photo, where that saves more
    than such a number costs (Schwarz 1978)."""
    depth = -state.C[:, 2] / state.R[:, 2, 2]
    focal = np.array([c.focal_px for c in bundle.cameras])[bundle.camera_of]
    moving = np.einsum("nji,nj->ni", state.R, bundle.velocity)[:, :2]
    px_s = -(focal / depth)[:, None] * moving
    if not np.isfinite(px_s).all():
        return np.zeros_like(state.roll)
    differing, found = px_s - px_s.mean(axis=0), state.roll - state.roll.mean(axis=0)
    readout_s = (differing * found).sum() / max(float((differing**2).sum()), 1e-12)
    before, after = (found**2).sum(), ((found - readout_s * differing) ** 2).sum()
    saved = found.size * np.log(max(before, 1e-12) / max(after, 1e-12))
    follows = 0.0 < readout_s < LONGEST_S and saved > np.log(found.size)
    return np.asarray(readout_s * px_s if follows else np.zeros_like(px_s))


def learnt_roll(state: State, bundle: Bundle, expected: Array, weight: Array, trust: Array) -> Array:
    """(2,) 1σ in pixels of what the rolling shutter does in x and y beyond what is expected of it: squares
    found over how many of the numbers the data determined (MacKay 1992), less two, since a variance learnt
    from few is itself unsure (the mean of its inverse-χ² distribution)."""
    n = len(state.C)
    residual, jacobians = linearise(state, bundle)
    system = reduced(state, bundle, residual, jacobians, weight, trust, 0.0)
    unit = np.zeros((len(system.g), 2 * n))
    own = PER_PHOTO * np.arange(n)[:, None] + [6, 7]
    unit[own.ravel(), np.arange(2 * n)] = 1.0
    variance = np.einsum("ik,ik->k", unit, solve_positive(system.S, unit, bundle.shared)).reshape(n, 2)
    determined = (1.0 - variance / bundle.sigma_roll**2).sum(axis=0)
    off = state.roll - expected
    if expected.any():  # what all share the photos do not tell, and it was held to none when these were found
        off = off - off.mean(axis=0)
    found = np.sqrt((off**2).sum(axis=0) / (determined - 2.0).clip(1.0))
    return np.asarray(found.clip(LEAST_ROLL_PX))
