"""How far points stand off the surface that they were laid on, as the photos themselves tell it."""

from dataclasses import dataclass

import numpy as np

from tasks.stitching.bundle import ALIKE, ON_SURFACE, Bundle, Spread, State, height_weight, linearise
from tasks.stitching.normal_equations import point_blocks
from tasks.stitching.rays import Apart, rays
from tasks.stitching.view import Array

LEAST_MOVED_PX = 0.25  # RMS, in a photo: heights that move points by less are lost in the noise of any


@dataclass(frozen=True)
class Heights:
    """Of points on the surface, plane units."""

    at: Array  # (T, 2)
    w: Array  # (T,) over the plane
    sigma: Array  # (T,) 1σ of w, as the rays tell it
    usual: float  # RMS of the true ones


def told_spread(state: State, bundle: Bundle, share: Array) -> tuple[Spread, float]:
    """Of points over a surface that they are held to, and 1σ of a coordinate in a photo beside them, px;
    cameras as they are. share: (M,) of each observation that counts, 0..1.

    What the rays of each track are apart has two parts (components of variance, Henderson 1953): one that a
    height explains and one that none does. ON_SURFACE where the first is no more than the second foretells,
    or costs more than such a number may (Schwarz 1978)."""
    p, lean = rays(state, bundle)
    apart = Apart.of(p, lean, bundle.track, share)
    tracks, power, unit = len(apart.power), float(apart.power.sum()), bundle.units_per_px(state)
    noise = max(apart.left / max(2 * share.sum() - 3 * tracks, 1), 1e-30)
    ratio = max(float((apart.agreed**2 / apart.power).mean()) / noise, 1.0)
    square = noise * (ratio - 1.0) * tracks / power
    noise_px, moved_px = float(np.sqrt(noise)) / unit, float(np.sqrt(square * power / share.sum())) / unit
    if moved_px < LEAST_MOVED_PX or tracks * (ratio - 1.0 - np.log(ratio)) < np.log(tracks):
        return ON_SURFACE, noise_px
    determined = float((square / (square + noise / apart.power)).sum())
    return Spread(float(np.sqrt(square)), determined), noise_px


def learnt_spread(state: State, bundle: Bundle, weight: Array) -> Spread:
    """Of points that are free already; ON_SURFACE where the rays determine less than half of them: the others
    would follow the noise. weight: (M,) of the observations, 1/px²."""
    of = ALIKE * height_weight(state, bundle)
    told = _told(state, bundle, weight)
    determined = float((told / (told + of)).sum())
    return ON_SURFACE if determined < 0.5 * len(told) else Spread(of**-0.5, determined)


def heights_in(state: State, bundle: Bundle, weight: Array) -> Heights | None:
    """None where the points are held to the surface. weight: (M,) of the observations, 1/px²."""
    if bundle.spread == ON_SURFACE:
        return None
    told = _told(state, bundle, weight)
    w = state.w * (1.0 + height_weight(state, bundle) / told)
    return Heights(state.X, w, told**-0.5, bundle.spread.sigma)


def _told(state: State, bundle: Bundle, weight: Array) -> Array:
    """(T,) 1/σ² of the heights by the rays alone."""
    _, jacobians = linearise(state, bundle)
    inverse, _ = point_blocks(state, bundle, jacobians.point, weight, np.zeros_like(bundle.xy), 0.0)
    of = height_weight(state, bundle)
    return np.maximum(1.0 / inverse[:, 2, 2] - of, 1e-6 * of)
