"""How a surface stands out of its plane: heights on a grid, from the scan points on it."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.fft import dctn, idctn
from scipy.stats import chi2

from tasks.surfaces.cloud import Floats, Indices

REACH_M = 0.15  # off the plane: farther things stand before the surface or lie behind it
AROUND_M = 0.5  # beyond the outline: photos show what lies beside, too
COARSE_M = 0.05  # cells that tell how dense the points are
SPACINGS = 2.0  # a cell's side, in mean distances of points: some four points a cell
SMALLEST_M, LARGEST_M = 0.02, 0.5  # of a cell
FEWEST = 100  # points
STANDS_OUT_M = 0.02  # of the median of 5 × 5 cells, beyond noise: no skin of a wall
MEDIAN = 1.2533  # the median of n points is off by 1.25 σ/√n
BANDS = 40  # of wave lengths, each as noisy or as real throughout


@dataclass(frozen=True)
class Heights:
    """Over the plane; (r, c) lies at u = left_m + c·cell_m, v = bottom_m + r·cell_m."""

    w_m: Floats  # (rows, columns)
    left_m: float
    bottom_m: float
    cell_m: float
    sigma_m: float  # of one height, where there are points


def heights_of(uvw_m: Floats, bounds_m: tuple[float, float, float, float]) -> Heights | None:
    """From (N, 3) points in the surface's frame; None where they tell of no relief beyond their noise.

    Each cell has the median of its points; cells that stand out from all around them (a cable before the
    wall) and those without points are filled from around; then the noise is taken out."""
    low, high = np.array(bounds_m[:2]) - AROUND_M, np.array(bounds_m[2:]) + AROUND_M
    near = (np.abs(uvw_m[:, 2]) < REACH_M) & ((uvw_m[:, :2] > low) & (uvw_m[:, :2] < high)).all(axis=1)
    points = uvw_m[near]
    if len(points) < FEWEST:
        return None
    occupied = len(np.unique(np.floor(points[:, :2] / COARSE_M).astype(np.int64), axis=0))
    spacing = COARSE_M * np.sqrt(occupied / len(points))
    cell = float(np.clip(SPACINGS * spacing, SMALLEST_M, LARGEST_M))
    columns, rows = (int(n) for n in np.ceil((high - low) / cell) + 1)
    at = np.rint((points[:, :2] - low) / cell).astype(np.int64)
    index, median, count, scatter = _medians(at[:, 1] * columns + at[:, 0], points[:, 2])
    sigma = MEDIAN * scatter / np.sqrt(float(np.median(count)))
    signal = float(np.var(median)) - sigma**2
    if signal <= sigma**2:
        return None
    w, known = np.zeros((rows, columns)), np.zeros((rows, columns))
    w.flat[index], known.flat[index] = median, 1.0
    around = cv2.medianBlur(_filled(w, known).astype(np.float32), 5)
    known[np.abs(w - around) > STANDS_OUT_M + 5.0 * sigma] = 0.0
    likeliest, sigma = _without_noise(_filled(w, known), sigma)
    return Heights(likeliest, float(low[0]), float(low[1]), cell, sigma)


def _medians(cell: Indices, w: Floats) -> tuple[Indices, Floats, Indices, float]:
    """Cells with points, the median of each, how many it has; σ of a point within its cell."""
    order = np.lexsort((w, cell))
    index, first, count = np.unique(cell[order], return_index=True, return_counts=True)
    sorted_w = w[order]
    median = (sorted_w[first + (count - 1) // 2] + sorted_w[first + count // 2]) / 2
    off = sorted_w - np.repeat(np.add.reduceat(sorted_w, first) / count, count)
    several = count >= 3
    squares = np.add.reduceat(off**2, first)[several] / chi2.median(count[several] - 1)
    return index, median, count, float(np.sqrt(np.median(squares))) if several.any() else 0.0


def _without_noise(w: Floats, sigma: float) -> tuple[Floats, float]:
    """What the heights are likeliest to be, and how well they are then known: the waves of each length shrunk
    by the share of noise in their power (Wiener 1949). Heights with their noise would make every parallax
    look too small, and so the cameras too far away (regression dilution)."""
    waves = dctn(w - w.mean(), norm="ortho")
    row, column = np.indices(w.shape)
    band = np.rint(BANDS * np.hypot(row / w.shape[0], column / w.shape[1])).astype(np.int64).ravel()
    power = np.bincount(band, waves.ravel() ** 2) / np.maximum(np.bincount(band), 1)
    kept = np.clip(1.0 - sigma**2 / np.maximum(power, 1e-30), 0.0, 1.0)[band].reshape(w.shape)
    return np.asarray(idctn(waves * kept, norm="ortho") + w.mean()), sigma * float(np.sqrt(kept.mean()))


def _filled(w: Floats, known: Floats) -> Floats:
    """Unknown cells from the coarser levels of a pyramid of means (pull–push, Gortler et al. 1996)."""
    if known.all() or min(w.shape) < 2:
        return np.asarray(np.where(known > 0, w, w.sum() / max(known.sum(), 1.0)))
    half = (-(-w.shape[1] // 2), -(-w.shape[0] // 2))
    weight = cv2.resize(known, half, interpolation=cv2.INTER_AREA)
    mean = cv2.resize(w * known, half, interpolation=cv2.INTER_AREA) / np.maximum(weight, 1e-12)
    coarse = _filled(np.where(weight > 0, mean, 0.0), (weight > 0).astype(np.float64))
    smooth = cv2.resize(coarse, w.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(np.where(known > 0, w, smooth))
