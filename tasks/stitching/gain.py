"""Gain compensation: one exposure factor a photo, all solved together (Brown & Lowe 2007, section 6).

Photos are compared in linear light, in overlaps as placed by the adjustment, by the median of the logarithm
of their ratio: shadows that moved and highlights that are clipped do not count."""

from collections.abc import Callable, Sequence

import cv2
import numpy as np
import numpy.typing as npt

from tasks.stitching.skyline import solve_positive
from tasks.stitching.view import Array, View

Pixels = npt.NDArray[np.uint8]

SHRINK = 8  # photos are averaged over squares of so many pixels before they are compared
SAMPLES = 40  # a side of the grid laid over each photo
SIGMA_PRIOR = 0.3  # 1σ of a photo's log exposure; binds only what overlaps nothing
LEAST_SAMPLES = 20


def srgb_to_linear() -> npt.NDArray[np.float32]:
    """(256,) linear light 0..1 of sRGB levels."""
    s = np.arange(256) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4).astype(np.float32)


def gain_table(gain: float) -> npt.NDArray[np.float32]:
    """(256,) sRGB levels (0..255, not rounded) after `gain` in linear light."""
    linear = np.clip(srgb_to_linear().astype(np.float64) * gain, 0.0, 1.0)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (255.0 * srgb).astype(np.float32)


def solve_gains(
    views: Sequence[View],
    read: Callable[[int], Pixels],
    pairs: Sequence[tuple[int, int]],
    on_progress: Callable[[float], None],
) -> Array:
    """(N,) factors on linear light, geometric mean 1. `read(i)` gives photo i as RGB; one at a time."""
    count = len(views)
    small = []
    for i in range(count):
        small.append(_linear_small(read(i)))
        on_progress((i + 1) / count)
    ratios = []
    for i, j in pairs:
        ratio = _log_ratio(views[i], views[j], small[i], small[j])
        if ratio is not None:
            ratios.append((i, j, *ratio))
    if not ratios:
        return np.ones(count)
    a, b = np.array([r[0] for r in ratios]), np.array([r[1] for r in ratios])
    measured, sigma = np.array([r[2] for r in ratios]), np.array([r[3] for r in ratios])
    log_gain = np.zeros(count)
    robust = np.ones(len(ratios))
    for _ in range(10):  # log g_a − log g_b = −measured, L1 beyond a few per cent
        w = robust / sigma**2
        A = np.diag(np.full(count, SIGMA_PRIOR**-2.0))
        right = np.zeros(count)
        np.add.at(A, (a, a), w)
        np.add.at(A, (b, b), w)
        np.add.at(A, (a, b), -w)
        np.add.at(A, (b, a), -w)
        np.add.at(right, a, -w * measured)
        np.add.at(right, b, w * measured)
        log_gain = solve_positive(A, right)
        left = np.abs(measured + log_gain[a] - log_gain[b])
        robust = 1.0 / np.maximum(left / np.maximum(3 * sigma, 0.02), 1.0)
    return np.asarray(np.exp(log_gain - log_gain.mean()))


def _linear_small(pixels: Pixels) -> npt.NDArray[np.float32]:
    """(h, w) linear light, mean of the colours; averaged in sRGB over 2 pixels, then in linear light."""
    height, width = pixels.shape[:2]
    half = cv2.resize(pixels, (max(width // 2, 1), max(height // 2, 1)), interpolation=cv2.INTER_AREA)
    linear = cv2.LUT(half, srgb_to_linear()).mean(axis=2)
    size = (max(width // SHRINK, 1), max(height // SHRINK, 1))
    return np.asarray(cv2.resize(linear, size, interpolation=cv2.INTER_AREA))


def _log_ratio(
    a: View, b: View, light_a: npt.NDArray[np.float32], light_b: npt.NDArray[np.float32]
) -> tuple[float, float] | None:
    """Median of log(light a / light b) over the overlap and its standard error."""
    w, h = a.camera.width_px - 1.0, a.camera.height_px - 1.0
    x, y = np.meshgrid(np.linspace(0, w, SAMPLES), np.linspace(0, h, SAMPLES))
    uv = a.to_plane(np.column_stack([x.ravel(), y.ravel()]))
    values_a, inside_a = _sample(light_a, a, uv)
    values_b, inside_b = _sample(light_b, b, uv)
    fit = (values_a > 0.004) & (values_b > 0.004) & (values_a < 0.9) & (values_b < 0.9)
    good = inside_a & inside_b & fit
    if good.sum() < LEAST_SAMPLES:
        return None
    logs = np.log(values_a[good] / values_b[good])
    middle = float(np.median(logs))
    spread = 1.4826 * float(np.median(np.abs(logs - middle)))
    return middle, max(1.2533 * spread / float(np.sqrt(good.sum())), 1e-4)


def _sample(light: npt.NDArray[np.float32], view: View, uv: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    with np.errstate(invalid="ignore"):
        photo = np.nan_to_num(view.to_photo(uv), nan=-1e6)
    scale = np.array([light.shape[1] / view.camera.width_px, light.shape[0] / view.camera.height_px])
    at = (photo + 0.5) * scale - 0.5
    inside = ((at >= 0) & (at <= np.array([light.shape[1] - 1, light.shape[0] - 1]))).all(axis=1)
    x, y = at.astype(np.float32).T
    values = cv2.remap(light, x[:, None], y[:, None], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return values.ravel().astype(np.float64), inside
