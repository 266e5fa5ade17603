"""Method `ridge`, training-free: Sauvola's threshold on valid pixels, k bound to the surface's texture.

Sauvola's k says how much darker than its surroundings a pixel must be. On a smooth surface the paper's 0.5
misses every faint crack, on a rough one a small k floods. So k follows the texture: the deviation of the
*brighter* half of each window, which cracks and pores do not touch. Two thresholds (hysteresis): weak pixels
give a crack its full extent, and it needs seed pixels that stand out clearly. Both must be dark against the
window's mean and against the closing, that is against both sides: the dark side of a shadow's edge is not.
"""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from tasks.detection.sauvola import Counts, Field, Grey, Mask, moments_of_valid, window_sum

WEAK, SEED = 1, 2
WEAK_TEXTURES, SEED_TEXTURES = 3.0, 5.0  # this many textures darker, where the surface is smooth
FAINTEST_WEAK, FAINTEST_SEED = 0.08, 0.12  # and never less than this share of the local brightness
WEAK_SHARE = 0.6  # of the setting's k: the highest k of weak pixels; seeds go up to k itself
TEXTURES_AT_LEAST = 2.0  # a seed on a rough surface is this many textures darker
NOISE_FLOOR = 1.5  # grey levels: rounding, JPEG and read noise that no smooth surface falls below
BINOMIAL = np.array([1.0, 4.0, 6.0, 4.0, 1.0])  # a Gaussian of σ = 1 px in integers: sums stay exact
SIXTEENTHS = 16.0  # the texture is summed in 1/16 grey levels, as integers

Levels256 = npt.NDArray[np.float32]  # (H, W): 256 × the grey level, whole numbers


class Scale(NamedTuple):
    """Lengths in pixels that the method works with."""

    window: int  # N, odd
    widest: int  # of a crack, odd: what is dark over more than this is a stain or a shadow

    @classmethod
    def of_window(cls, window_px: int) -> "Scale":
        return cls(window_px | 1, (window_px // 2) | 1)

    @property
    def halo(self) -> int:
        """How far away a pixel can matter."""
        return 2 * (self.window // 2) + self.widest + len(BINOMIAL)


def dark_levels(grey: Grey, valid: Mask, scale: Scale, k: float, R: float) -> npt.NDArray[np.uint8]:
    """(H, W): 0, WEAK or SEED for every pixel of (H, W) grey. Invalid pixels are 0 and have no say."""
    local = moments_of_valid(grey, valid, scale.window)
    filled = np.where(valid, grey, np.rint(local.mean).astype(np.uint8))
    smooth256 = np.asarray(cv2.sepFilter2D(filled, cv2.CV_32F, BINOMIAL, BINOMIAL), dtype=np.float32)
    box = np.ones((scale.widest, scale.widest), np.uint8)
    closed256 = np.asarray(cv2.morphologyEx(smooth256, cv2.MORPH_CLOSE, box), dtype=np.float32)
    squares = window_sum(_brighter_half(smooth256, local.mean, valid), scale.window)
    levels: npt.NDArray[np.uint8] = _levels(smooth256, closed256, *local, squares, valid, k, R)
    return levels


@njit(cache=True, nogil=True)
def _brighter_half(smooth256: Levels256, mean: Field, valid: Mask) -> npt.NDArray[np.int32]:
    """Squared excess over the mean of what is brighter than it, in whole 1/16 grey levels."""
    squared = np.zeros(mean.shape, np.int32)
    for y in range(mean.shape[0]):
        for x in range(mean.shape[1]):
            if valid[y, x]:
                excess = smooth256[y, x] / 256.0 - mean[y, x]
                if excess > 0.0:
                    squared[y, x] = np.int32(np.rint(excess * SIXTEENTHS)) ** 2
    return squared


@njit(cache=True, nogil=True)
def _levels(
    smooth256: Levels256,
    closed256: Levels256,
    mean: Field,
    deviation: Field,
    count: Counts,
    squares: Counts,
    valid: Mask,
    k: float,
    R: float,
) -> npt.NDArray[np.uint8]:
    levels = np.zeros(mean.shape, dtype=np.uint8)
    most_weak, most_seed = max(WEAK_SHARE * k, FAINTEST_WEAK), max(k, FAINTEST_SEED)
    for y in range(mean.shape[0]):
        for x in range(mean.shape[1]):
            if not valid[y, x]:
                continue
            depth = min(mean[y, x], closed256[y, x] / 256.0) - smooth256[y, x] / 256.0
            texture = np.sqrt(2.0 * squares[y, x] / count[y, x]) / SIXTEENTHS
            rough = max(texture, NOISE_FLOOR)
            share = rough / max(mean[y, x], 1.0)
            unit = mean[y, x] * (1.0 - deviation[y, x] / R)  # Sauvola's T is mean − k · unit
            if depth <= min(max(WEAK_TEXTURES * share, FAINTEST_WEAK), most_weak) * unit:
                continue
            k_seed = min(max(SEED_TEXTURES * share, FAINTEST_SEED), most_seed)
            levels[y, x] = SEED if depth > k_seed * unit and depth > TEXTURES_AT_LEAST * rough else WEAK
    return levels
