"""A crack's centreline: a smooth line through its skeleton, to a fraction of a pixel."""

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from schemas.bit_mask import BitMask

Points = npt.NDArray[np.float64]  # (N, 2) x, y in pixels

SMOOTH_PX = 3.0  # σ along the line: takes the staircase of pixels out, leaves the wander of a crack in


def smooth(points: Points, sigma_px: float = SMOOTH_PX) -> Points:
    """Smoothed and resampled at steps of about 1 px; the ends stay where they are."""
    even = resample(points, 1.0)
    if len(even) < 3:
        return even
    reach = min(len(even) - 1, int(4 * sigma_px))
    before = 2 * even[0] - even[reach:0:-1]  # mirrored through its ends, so that they do not shrink
    after = 2 * even[-1] - even[-2 : -2 - reach : -1]
    smoothed = gaussian_filter1d(np.concatenate([before, even, after]), sigma_px, axis=0)
    return resample(smoothed[reach : reach + len(even)], 1.0)


def straight_ends(points: Points, cut_px: int, mask: BitMask) -> Points:
    """The last pixels at each end replaced by a straight line on to where the mask ends: a skeleton's
    end turns into a corner of its mask, or stops short of its end by as much as its width."""
    if cut_px < 1 or len(points) < 6 * cut_px:
        return points
    inner = points[cut_px:-cut_px]
    first, last = ((inner[a] - inner[b]) / (2 * cut_px) for a, b in ((0, 2 * cut_px), (-1, -1 - 2 * cut_px)))
    before = _straight_on(inner[0], first, 3 * cut_px + 1, mask)[::-1]
    return np.concatenate([before, inner, _straight_on(inner[-1], last, 3 * cut_px + 1, mask)])


def _straight_on(
    start: npt.NDArray[np.float64], step: npt.NDArray[np.float64], most: int, mask: BitMask
) -> Points:
    """Steps from the start, at most so many, that stay within the mask."""
    ahead = start + np.arange(1, most + 1)[:, None] * step
    x, y = np.rint(ahead).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < mask.width_px) & (y < mask.height_px)
    inside[inside] = mask.at(y[inside], x[inside])
    return ahead[: len(ahead) if inside.all() else int(inside.argmin())]


def resample(points: Points, step_px: float) -> Points:
    """Points at even distances of about `step_px` along a polyline, its ends among them."""
    along = arc_length(points)
    count = max(2, round(float(along[-1]) / step_px) + 1)
    at = np.linspace(0.0, along[-1], count)
    return np.column_stack([np.interp(at, along, points[:, n]) for n in (0, 1)])


def arc_length(points: Points) -> npt.NDArray[np.float64]:
    """(N,) length along a polyline up to each point."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def normals(points: Points) -> Points:
    """(N, 2) unit normals: the tangent turned by 90° (x right, y down: to its right-hand side)."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.maximum(np.hypot(*tangent.T), 1e-9)[:, None]
    return np.column_stack([-tangent[:, 1], tangent[:, 0]])


def orientation_deg(points: Points) -> float:
    """Direction of the main axis (least squares): 0 along +x, counter-clockwise as seen, in [0, 180).

    Image y points down, so up on the surface is −y."""
    x, y = (points - points.mean(axis=0)).T
    twice = np.arctan2(2.0 * -(x * y).mean(), (x * x).mean() - (y * y).mean())
    return float(np.degrees(twice) / 2.0 % 180.0) % 180.0


def simplify(points: Points, tolerance_px: float) -> Points:
    """Fewer points, none of the line moved by more than the tolerance (Douglas–Peucker)."""
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    waiting = [(0, len(points) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        chord = points[last] - points[first]
        between = points[first + 1 : last] - points[first]
        length = float(np.hypot(*chord))
        if length < 1e-9:
            away = np.hypot(*between.T)
        else:
            away = np.abs(between[:, 0] * chord[1] - between[:, 1] * chord[0]) / length
        middle = first + 1 + int(away.argmax())
        if away.max() > tolerance_px:
            keep[middle] = True
            waiting += [(first, middle), (middle, last)]
    return points[keep]
