"""Sauvola's local threshold (Sauvola & Pietikäinen 2000; paper, eq. 5 to 7).

T = m[1 + k(s/R − 1)], with m and s the mean and standard deviation of the N×N window around a pixel.
A crack is darker than its surroundings, so a pixel is a candidate where it lies *below* T. (The paper's
last sentence on it says "higher"; a page earlier it says itself that cracks are darker.)

Sums run along the image as whole numbers, so that they are exact: a band with its halo gives bit for bit
what the whole image gives.
"""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from schemas.raster import Pixels

Grey = npt.NDArray[np.uint8]  # (H, W), 0..255
Field = npt.NDArray[np.float64]  # (H, W)
Mask = npt.NDArray[np.bool_]  # (H, W)
Counts = npt.NDArray[np.int64]  # (H, W), whole numbers


class Moments(NamedTuple):
    """Of the window around each pixel."""

    mean: Field
    deviation: Field
    valid: Counts  # pixels that count


def grey_of(rgb: Pixels) -> Grey:
    """(H, W) luma (ITU-R BT.601) of (H, W, 3) RGB."""
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def sauvola(grey: Grey, window_px: int, k: float, R: float) -> Mask:
    """Faithful: pixels below T; every pixel counts, the border is mirrored (as scikit-image does)."""
    reach = window_px // 2
    mirrored = cv2.copyMakeBorder(grey, reach, reach, reach, reach, cv2.BORDER_REFLECT_101)
    below: Mask = _below(np.asarray(mirrored, dtype=np.uint8), reach, k, R)
    return below


@njit(cache=True, nogil=True)
def _below(mirrored: Grey, reach: int, k: float, R: float) -> Mask:
    """Running sums down the columns, then along the row. T needs no root: g < T is g − m(1 − k) < (mk/R) s,
    true where the left side is negative, else compared as squares."""
    size = 2 * reach + 1
    height, width = mirrored.shape[0] - 2 * reach, mirrored.shape[1] - 2 * reach
    columns = mirrored.shape[1]
    below = np.empty((height, width), np.bool_)
    summed, squared = np.zeros(columns, np.int64), np.zeros(columns, np.int64)
    for y in range(size - 1):
        for x in range(columns):
            new = np.int32(mirrored[y, x])
            summed[x] += new
            squared[x] += new * new
    s, q = np.empty(width, np.int64), np.empty(width, np.int64)
    share = 1.0 / (size * size)
    for y in range(height):
        for x in range(columns):
            new = np.int32(mirrored[y + size - 1, x])
            summed[x] += new
            squared[x] += new * new
        _along(summed, size, s)
        _along(squared, size, q)
        for x in range(width):
            m = s[x] * share
            above = mirrored[y + reach, x + reach] - m * (1.0 - k)
            slope = m * k / R
            below[y, x] = (above < 0.0) | (above * above < slope * slope * (q[x] * share - m * m))
        for x in range(columns):
            old = np.int32(mirrored[y, x])
            summed[x] -= old
            squared[x] -= old * old
    return below


@njit(cache=True, nogil=True)
def _along(values: npt.NDArray[np.int64], size: int, out: npt.NDArray[np.int64]) -> None:
    """Sums of `size` neighbours."""
    run = np.int64(0)
    for x in range(size - 1):
        run += values[x]
    for x in range(len(out)):
        run += values[x + size - 1]
        out[x] = run
        run -= values[x]


def moments_of_valid(grey: Grey, valid: Mask, window_px: int) -> Moments:
    """Mean and deviation of the valid pixels of every window; zero where it holds none.

    What is masked, blank or beyond the border has no say, so that no false dark or bright rim arises.
    """
    known = np.where(valid, grey, np.uint8(0)).astype(np.int32)
    count = window_sum(valid.astype(np.int32), window_px)
    return Moments(
        *_moments(window_sum(known, window_px), window_sum(known * known, window_px), count), count
    )


@njit(cache=True, nogil=True)
def _moments(summed: Counts, squared: Counts, count: Counts) -> tuple[Field, Field]:
    mean, deviation = np.zeros(count.shape), np.zeros(count.shape)
    for y in range(count.shape[0]):
        for x in range(count.shape[1]):
            if count[y, x] > 0:
                m = summed[y, x] / count[y, x]
                mean[y, x] = m
                deviation[y, x] = np.sqrt(max(squared[y, x] / count[y, x] - m * m, 0.0))
    return mean, deviation


@njit(cache=True, nogil=True)
def window_sum(values: npt.NDArray[np.int32], window_px: int) -> Counts:
    """(H, W) sum of whole numbers over the window around each pixel; outside the image there is nothing."""
    height, width = values.shape
    reach = window_px // 2
    down = np.zeros(width + 2 * reach, np.int64)  # sums down the columns, nothing left and right of them
    out = np.empty((height, width), np.int64)
    for y in range(-reach, height):
        if y + reach < height:
            for x in range(width):
                down[x + reach] += values[y + reach, x]
        if y - reach - 1 >= 0:
            for x in range(width):
                down[x + reach] -= values[y - reach - 1, x]
        if y >= 0:
            _along(down, 2 * reach + 1, out[y])
    return out
