"""Global thresholds: the baselines that the paper's local one is compared with."""

import numpy as np
import numpy.typing as npt

from schemas.detection import Peaks
from tasks.detection.sauvola import Grey, Mask

PAPER = (125, 155)  # the two that the paper shows

Histogram = npt.NDArray[np.int64]  # (256,) pixels of each grey level


def darker_than(grey: Grey, valid: Mask, threshold: float) -> Mask:
    return np.asarray((grey < threshold) & valid)


def otsu(histogram: Histogram) -> float:
    """Threshold of the largest variance between classes (Otsu 1979); 0 where there is one level only.

    Where several thresholds do equally well (an empty stretch between two modes), their middle."""
    levels = np.arange(256)
    below = np.concatenate([[0], np.cumsum(histogram)[:-1]]).astype(np.float64)  # pixels < t
    sum_below = np.concatenate([[0], np.cumsum(histogram * levels)[:-1]]).astype(np.float64)
    total, sum_total = float(histogram.sum()), float((histogram * levels).sum())
    above = total - below
    both = (below > 0) & (above > 0)
    if not both.any():
        return 0.0
    difference = sum_below[both] / below[both] - (sum_total - sum_below[both]) / above[both]
    between = below[both] * above[both] * difference**2
    return float(levels[both][between >= between.max() * (1 - 1e-12)].mean())


def darker_peak(peaks: Peaks) -> int | None:
    """The peak next below the surface's that is not the blank area's."""
    darker = [
        p for p in peaks.peaks if peaks.i_surface is not None and p < peaks.i_surface and p != peaks.i_blank
    ]
    return max(darker, default=None)


def from_peaks(histogram: Histogram, peaks: Peaks) -> float:
    """Midway between the surface's peak and the next darker one (as the paper cuts between two peaks);
    Otsu's threshold where the histogram has no darker peak. Grey levels."""
    darker = darker_peak(peaks)
    if darker is None or peaks.i_surface is None:
        return otsu(histogram)
    return (darker + peaks.i_surface) / 2
