"""Dominant peaks of a histogram, their number not given by hand.

The paper cites its authors' peak detection of 2016 and prints no steps; this follows the published
description of its descendant, the Summit Navigator (Dinh, Phung, Ha, IEEE Trans. Image Processing 29, 2020):
peaks are looked at from one viewpoint on the axis, as summits from a plain; those that others overtop are
dropped, then those that are mere shoulders of a straight slope.

Ours is the safeguard `_stands_alone`: a low mode between two high ones is overtopped from any viewpoint, yet
valleys on both sides, too deep to be noise, show that it is a mode.
"""

import numpy as np
import numpy.typing as npt

STRAIGHT_R2 = 0.86  # the example value of its authors
DOMINANT = 0.01  # of the highest peak: lower ones are stray pixels
VALLEY = 0.9  # two peaks with no lower ground than this share of the lower one between them are one
NOISE = 4.0  # and so are those whose valley lies within this many deviations of a count, its root

Heights = npt.NDArray[np.float64]  # (256,) smoothed counts
Indices = npt.NDArray[np.intp]  # grey levels, ascending


def dominant_peaks(histogram: npt.NDArray[np.int64]) -> tuple[int, ...]:
    """Grey levels of the dominant peaks of a (256,) histogram, ascending; none where it is empty."""
    counts = np.asarray(histogram, dtype=np.float64)
    heights = np.convolve(np.pad(counts, 1, mode="edge"), np.ones(3) / 3, mode="valid")
    peaks = _local_maxima(heights)
    peaks = peaks[heights[peaks] > DOMINANT * heights.max()]
    if len(peaks) > 1:
        peaks = peaks[_overlooking(peaks, heights) | _standing_alone(peaks, heights)]
    return tuple(int(p) for p in _without_shoulders(peaks, heights))


def _local_maxima(heights: Heights) -> Indices:
    """Strict maxima, both ends included; of a plateau its middle."""
    changes = np.flatnonzero(np.diff(heights)) + 1
    starts, ends = np.concatenate([[0], changes]), np.concatenate([changes, [len(heights)]])
    levels = heights[starts]
    beside = np.concatenate([[-np.inf], levels, [-np.inf]])
    top = (levels > beside[:-2]) & (levels > beside[2:]) & (levels > 0)
    return np.asarray(((starts + ends - 1) // 2)[top], dtype=np.intp)


def _overlooking(peaks: Indices, heights: Heights) -> npt.NDArray[np.bool_]:
    """Which peaks have an observability C_k = h_k / (s_k − L*) that no neighbour exceeds.

    L* is the lowest crossing of the axis by a line through two peaks. Where heights only fall, no line
    crosses left of them: look from the right."""
    position, height = peaks.astype(np.float64), heights[peaks]
    viewpoint = _viewpoint(position, height)
    if viewpoint >= position[0]:
        position, height = -position[::-1], height[::-1]
        viewpoint = min(_viewpoint(position, height), position[0] - 1.0)
        return _overlooking_from(viewpoint, position, height)[::-1]
    return _overlooking_from(viewpoint, position, height)


def _viewpoint(position: Heights, height: Heights) -> float:
    j, k = np.triu_indices(len(position), 1)
    rise = height[k] - height[j]
    rise = np.where(np.abs(rise) < 1e-9, 1e-9, rise)
    return float((position[k] - height[k] * (position[k] - position[j]) / rise).min())


def _overlooking_from(viewpoint: float, position: Heights, height: Heights) -> npt.NDArray[np.bool_]:
    seen = np.pad(height / (position - viewpoint), 1)
    tolerance = 1e-9 * seen.max()  # two peaks on one line of sight are seen alike
    return np.asarray((seen[1:-1] >= seen[:-2] - tolerance) & (seen[1:-1] >= seen[2:] - tolerance))


def _standing_alone(peaks: Indices, heights: Heights) -> npt.NDArray[np.bool_]:
    """Which peaks have, towards every higher one, a valley below half their height and out of noise."""
    alone = np.ones(len(peaks), dtype=bool)
    for n, peak in enumerate(peaks):
        height = heights[peak]
        deep = min(height / 2, height - NOISE * np.sqrt(height))
        left = [p for p in peaks[:n] if heights[p] >= height]
        right = [p for p in peaks[n + 1 :] if heights[p] > height]
        valleys = [heights[left[-1] : peak].min()] if left else []
        valleys += [heights[peak : right[0]].min()] if right else []
        alone[n] = all(valley < deep for valley in valleys)
    return alone


def _without_shoulders(peaks: Indices, heights: Heights) -> Indices:
    """Drop the lower of two neighbours where the histogram between them is a straight line, or where no
    valley is to be told from noise. Until nothing changes."""
    kept = [int(p) for p in peaks]
    n = 0
    while n + 1 < len(kept):
        low, high = kept[n], kept[n + 1]
        if _is_slope(heights[low : high + 1]):
            del kept[n if heights[low] < heights[high] else n + 1]
            n = 0
        else:
            n += 1
    return np.asarray(kept, dtype=np.intp)


def _is_slope(between: Heights) -> bool:
    lower = min(between[0], between[-1])
    if between.min() > min(VALLEY * lower, lower - NOISE * np.sqrt(lower)):
        return True
    if np.ptp(between) == 0.0:
        return True
    return float(np.corrcoef(np.arange(len(between)), between)[0, 1]) ** 2 > STRAIGHT_R2
