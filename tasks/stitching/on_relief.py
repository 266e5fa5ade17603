"""Photos laid on the relief that scans measured: where along the surface does it fit what the photos see?

Positions are known to decimetres or a metre, the relief to centimetres. Adjusted as if the surface were
flat, the cameras see its points from several places, and so tell how high each stands, but for what bends
slowly: that went into the cameras. The shift at which these heights agree best with the scan's is the one to
adjust from, now on the relief."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.signal import fftconvolve

from schemas.camera import Camera
from tasks.stitching.adjustment import Adjusted
from tasks.stitching.rays import Apart, as_taken, rays_of
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import Observations
from tasks.stitching.view import Array, View

SIGMAS = 3.0  # of the positions: how far the photos may lie from where they were said to
SLOW = 0.25  # of a photo's width: waves longer than some of these bend the cameras instead
LEAST_LIKENESS = 0.25  # of heights, −1..1; less is chance

Adjust = Callable[[Sequence[View], Observations], Adjusted]


def on_relief(
    relief: HeightMap,
    flat: Adjusted,
    guesses: Sequence[View],
    observations: Observations,
    sigma_position: float,
    adjust: Adjust,
) -> Adjusted:
    """The cameras adjusted on the relief; as they were on the plane where it explains the photos no better.

    guesses: the views that `flat` was adjusted from; `adjust` adjusts others."""
    cameras = [view.camera for view in guesses]
    width = float(np.median([v.units_per_px * v.camera.width_px for v in flat.views]))
    at, heights, weight = seen_heights(flat, cameras)
    shift = best_shift(relief, at, heights, weight, SIGMAS * sigma_position, SLOW * width)
    views = [
        replace(v.moved(1.0, 0.0, shift), camera=c, roll_px=np.zeros(2), relief=relief)
        for v, c in zip(flat.views, cameras, strict=True)
    ]
    raised = adjust(views, observations)
    kept = len(raised.observations.photo) / len(flat.observations.photo)
    return raised if raised.sigma_px < kept * flat.sigma_px else flat


def seen_heights(flat: Adjusted, cameras: Sequence[Camera]) -> tuple[Array, Array, Array]:
    """(T, 2) places, (T,) heights and (T,) their weights, of the tracks as the cameras over the plane see
    them. cameras: those under which the observations are undistorted.

    A photo sees a point at height w over p + w·g, where p is where its ray meets the plane and g how the
    ray leans; least squares over the photos of a track."""
    photo, track = flat.observations.photo, flat.observations.track
    p, g = np.zeros((len(photo), 2)), np.zeros((len(photo), 2))
    for i in np.unique(photo):
        mine = photo == i
        p[mine], g[mine] = rays_of(flat.views[i], as_taken(flat.observations.xy[mine], cameras[i]))
    apart = Apart.of(p, g, track, np.ones(len(track)))
    heights = apart.agreed / apart.power
    return np.asarray(apart.at + heights[:, None] * apart.lean), heights, apart.power


def best_shift(
    relief: HeightMap, at: Array, heights: Array, weight: Array, reach: float, slow: float
) -> Array:
    """(2,) to add to the places so that the heights are most like the relief's; 0 where none is like it.

    All shifts by whole cells at once (normalised correlation by Fourier transform); waves longer than some
    `slow` do not count."""
    cell, (rows, columns) = relief.cell, relief.w.shape
    c = np.rint((at[:, 0] - relief.left) / cell).astype(np.int64)
    r = np.rint((at[:, 1] - relief.bottom) / cell).astype(np.int64)
    n = min(int(np.ceil(reach / cell)), max(rows, columns))
    good = np.isfinite(heights) & (c >= 0) & (c < columns) & (r >= 0) & (r < rows)
    place, size = (r * columns + c)[good], rows * columns
    seen = np.bincount(place, weight[good], size).reshape(rows, columns)
    high = np.bincount(place, weight[good] * heights[good], size).reshape(rows, columns)
    mean = gaussian_filter(high, slow / cell) / np.maximum(gaussian_filter(seen, slow / cell), 1e-12)
    high = high - seen * mean
    fast = np.pad(relief.w - gaussian_filter(relief.w, slow / cell, mode="nearest"), n)
    alike = fftconvolve(fast, high[::-1, ::-1], mode="valid")
    power = fftconvolve(fast**2, seen[::-1, ::-1], mode="valid")
    own = float((high**2 / np.maximum(seen, 1e-12)).sum())
    likeness = alike / np.sqrt(np.maximum(power, 1e-9 * max(float(power.max()), 1e-12)) * max(own, 1e-30))
    v, u = np.unravel_index(int(np.argmax(likeness)), likeness.shape)
    if likeness[v, u] < LEAST_LIKENESS:
        return np.zeros(2)
    return np.array([u - n, v - n]) * cell
