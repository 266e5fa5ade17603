"""Sauvola's local threshold (Sauvola & Pietikäinen 2000; paper, eq. 5 to 7).

T = m[1 + k(s/R − 1)], with m and s the mean and standard deviation of the N×N window around a pixel.
A crack is darker than its surroundings, so a pixel is a candidate where it lies *below* T. (The paper's
last sentence on it says "higher"; a page earlier it says itself that cracks are darker.)

Sums run along the image as integers held in float64, so that they are exact: a band with its halo gives
bit for bit what the whole image gives.
"""

from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from schemas.raster import Pixels

Grey = npt.NDArray[np.uint8]  # (H, W), 0..255
Field = npt.NDArray[np.float64]  # (H, W)
Mask = npt.NDArray[np.bool_]  # (H, W)


class Moments(NamedTuple):
    mean: Field
    deviation: Field


def grey_of(rgb: Pixels) -> Grey:
    """(H, W) luma (ITU-R BT.601) of (H, W, 3) RGB."""
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(rgb), cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def window_sum(values: Field, window_px: int, border: int = cv2.BORDER_CONSTANT) -> Field:
    """(H, W) sum over the window around each pixel; outside the image there is nothing."""
    size = (window_px, window_px)
    summed = cv2.boxFilter(values, cv2.CV_64F, size, normalize=False, borderType=border)
    return np.asarray(summed, dtype=np.float64)


def moments(grey: Grey, window_px: int) -> Moments:
    """Mean and deviation of every window, the image mirrored at its border (as scikit-image does)."""
    area = window_px * window_px
    values = grey.astype(np.float64)
    mean = window_sum(values, window_px, cv2.BORDER_REFLECT_101) / area
    square = window_sum(values * values, window_px, cv2.BORDER_REFLECT_101) / area
    return Moments(mean, np.sqrt(np.maximum(square - mean * mean, 0.0)))


def moments_of_valid(grey: Grey, valid: Mask, window_px: int) -> Moments:
    """Mean and deviation of the valid pixels of every window; zero where it holds none.

    What is masked, blank or beyond the border has no say, so that no false dark or bright rim arises.
    """
    weight = valid.astype(np.float64)
    values = grey * weight
    count = np.maximum(window_sum(weight, window_px), 1.0)
    mean = window_sum(values, window_px) / count
    square = window_sum(values * values, window_px) / count
    return Moments(mean, np.sqrt(np.maximum(square - mean * mean, 0.0)))


def threshold(local: Moments, k: float | Field, R: float) -> Field:
    """T of every pixel, grey levels."""
    return np.asarray(local.mean * (1.0 + k * (local.deviation / R - 1.0)))


def sauvola(grey: Grey, window_px: int, k: float, R: float) -> Mask:
    """Faithful: pixels below T, every pixel of the image counted."""
    return np.asarray(grey < threshold(moments(grey, window_px), k, R))
