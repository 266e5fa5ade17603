"""Grey profiles across a centreline, in linear light, as shares of the brightness beside the crack."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates, uniform_filter1d

from schemas.raster import Pixels, Raster
from tasks.measurement.centreline import Points, normals

STEP_PX = 0.5  # between the samples of a profile
ALONG_PX = 5  # neighbouring profiles averaged: a width is that of this much of the crack
CHUNK_PX = 200  # profiles read together, so that a long crack needs no large window
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear RGB (ITU-R BT.709)

Values = npt.NDArray[np.float64]
Profiles = Values  # (N, T): darkness, 0 beside the crack, 1 where no light comes back


def _linear_of_srgb() -> npt.NDArray[np.float64]:
    s = np.arange(256) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


LINEAR = _linear_of_srgb()  # (256,): IEC 61966-2-1


class Across(NamedTuple):
    offsets_px: npt.NDArray[np.float64]  # (T,) along the normal
    darkness: Profiles
    usable: npt.NDArray[np.bool_]  # (N,): wholly on known pixels


def linear_luminance(rgb: Pixels) -> npt.NDArray[np.float64]:
    """(H, W) luminance, 0..1. Grey values must be made linear first: light adds, sRGB values do not."""
    channels = (weight * LINEAR[rgb[..., n]] for n, weight in enumerate(LUMINANCE))
    return np.asarray(sum(channels))


def across(raster: Raster, centreline: Points, half_px: float, step_px: float = STEP_PX) -> Across:
    """Darkness 1 − I / background along the normals, ±half_px about each point of the centreline."""
    count = int(np.ceil(half_px / step_px))
    offsets: Values = np.arange(-count, count + 1, dtype=np.float64) * step_px
    direction = normals(centreline)
    light = np.empty((len(centreline), len(offsets)))
    usable = np.empty(len(centreline), dtype=bool)
    for first in range(0, len(centreline), CHUNK_PX):
        part = slice(first, first + CHUNK_PX)
        x, y = (centreline[part, n, None] + direction[part, n, None] * offsets for n in (0, 1))
        light[part], usable[part] = _sample(raster, x, y)
    light = uniform_filter1d(light, ALONG_PX, axis=0, mode="nearest")
    return Across(offsets, 1.0 - light / _background(light, offsets), usable)


def _sample(
    raster: Raster, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Luminance at (N, T) positions by cubic splines (bilinear would blur by 0.4 px), and which rows of it
    lie on known pixels."""
    margin = 8
    x0, x1 = max(0, int(x.min()) - margin), min(raster.width_px, int(x.max()) + margin + 2)
    y0, y1 = max(0, int(y.min()) - margin), min(raster.height_px, int(y.max()) + margin + 2)
    light = linear_luminance(raster.rgb(y0, y1, x0, x1))
    known = raster.valid(y0, y1, x0, x1)
    at = np.stack([y - y0, x - x0])
    values = map_coordinates(light, at, order=3, mode="nearest")
    there = map_coordinates(known.astype(np.uint8), at, order=0, mode="constant", cval=0)
    return np.asarray(np.maximum(values, 0.0)), np.asarray(there.all(axis=1))


def _background(light: npt.NDArray[np.float64], offsets: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(N, T): the line between the levels on the two sides, each the median of its outer 40 %."""
    reach = offsets[-1]
    left, right = offsets < -0.6 * reach, offsets > 0.6 * reach
    a, b = np.median(light[:, left], axis=1), np.median(light[:, right], axis=1)
    share = np.clip((offsets / reach / 0.8 + 1) / 2, 0.0, 1.0)
    return np.asarray(np.maximum(a[:, None] * (1 - share) + b[:, None] * share, 1e-4))
