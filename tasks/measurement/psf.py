"""The image's blur, from the edges of its own wide cracks."""

from typing import NamedTuple

import numpy as np

from tasks.measurement.profiles import Profiles
from tasks.measurement.width_profile import DARKEST, Values, products, slit

# σ of a sharp photo, resampled once into a mosaic, taken where nothing tells better: of 150 photos of uav
# whose cracks tell it half have 0.7 to 0.9, nine in ten 0.6 to 1.2 (tests.benchmarks.detection, part blur).
DEFAULT_PX, DEFAULT_SIGMA_PX = 0.8, 0.2
TOLD_SIGMA_PX = 0.05  # of one that wide cracks tell
TRIED_PX = np.arange(5, 21) / 10
LEAST_WIDTH_PX = 5.0  # both edges of such a crack are seen apart
ENOUGH = 40  # profiles that must agree
MOST = 200  # profiles of one crack are looked at
SHARPEST = 0.25  # quantile: chipped edges only ever add to the blur


class Psf(NamedTuple):
    px: float  # σ of the blur
    sigma_px: float  # and how well it is known


def estimated_psf(of_cracks: list[tuple[Values, Profiles]]) -> Psf:
    """From (offsets, darkness) of all cracks, or the default where too few are wide enough."""
    found: list[float] = []
    for offsets, every in of_cracks:
        if offsets[-1] < 2 * LEAST_WIDTH_PX:
            continue
        darkness = every[:: max(1, len(every) // MOST)]
        errors, widths = zip(*(_fit(offsets, darkness, float(s)) for s in TRIED_PX), strict=True)
        best = np.stack(errors).argmin(axis=0)
        width = np.stack(widths)[best, np.arange(len(darkness))]
        inner = (best > 0) & (best < len(TRIED_PX) - 1) & (width >= LEAST_WIDTH_PX)
        found += [float(TRIED_PX[b]) for b in best[inner]]
    if len(found) < ENOUGH:
        return Psf(DEFAULT_PX, DEFAULT_SIGMA_PX)
    return Psf(float(np.quantile(found, SHARPEST)), TOLD_SIGMA_PX)


def _fit(offsets: Values, darkness: Profiles, sigma_px: float) -> tuple[Values, Values]:
    """Least error of each profile over width and darkness, and that width."""
    widths = np.arange(LEAST_WIDTH_PX - 1, 0.7 * 2 * offsets[-1], 0.25)
    level = darkness - darkness.mean(axis=1, keepdims=True)
    energy = (level * level).sum(axis=1)
    errors = np.full(len(darkness), np.inf)
    width = np.zeros(len(darkness))
    for shift in np.arange(-1.0, 1.01, 0.25):
        shapes = slit(offsets, widths, sigma_px, float(shift))
        shapes = shapes - shapes.mean(axis=1, keepdims=True)
        size = (shapes * shapes).sum(axis=1)
        seen = products(level, shapes)
        d = np.clip(seen / size, 0.02, DARKEST)
        error = energy[:, None] - 2 * d * seen + d * d * size
        at = error.argmin(axis=1)
        least = error[np.arange(len(at)), at]
        width = np.where(least < errors, widths[at], width)
        errors = np.minimum(errors, least)
    return errors, width
