"""Cracks of known line and width, drawn in linear light, blurred, made noisy and sRGB."""

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[np.uint8]
SUPERSAMPLED = 8


class Drawn(NamedTuple):
    rgb: Pixels
    x: npt.NDArray[np.float64]  # the centreline y(x), in pixels
    y: npt.NDArray[np.float64]
    length_px: float


def drawn_crack(
    width_px: Callable[[npt.NDArray[np.float64]], npt.NDArray[np.float64]],
    *,
    darkness: float = 0.7,
    psf_px: float = 0.7,
    noise: float = 4.0,
    slope: float = 0.1,
    amplitude_px: float = 4.0,
    size: tuple[int, int] = (160, 480),
    bright: npt.NDArray[np.float64] | float = 0.4,
    seed: int = 0,
) -> Drawn:
    """A crack from the left to the right rim along y = middle + slope·x + a sine.

    width_px(x): its width; darkness: share of light that does not come back; bright: linear light beside it,
    a number or (H, W); noise: σ in sRGB grey levels."""
    height, width = size
    x, y = ((np.arange(n * SUPERSAMPLED) + 0.5) / SUPERSAMPLED - 0.5 for n in (width, height))
    line = height / 2 + slope * (x - width / 2) + amplitude_px * np.sin(x / 40)
    steep = slope + amplitude_px / 40 * np.cos(x / 40)
    away = np.abs(y[:, None] - line) / np.hypot(1.0, steep)
    light = np.where(away < width_px(x) / 2, 1.0 - darkness, 1.0).astype(np.float32)
    light = cv2.GaussianBlur(light, (0, 0), psf_px * SUPERSAMPLED)
    light = cv2.resize(light, (width, height), interpolation=cv2.INTER_AREA) * bright
    grey = srgb(light) * 255 + np.random.default_rng(seed).normal(size=size) * noise
    eight_bit = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    length = float(np.hypot(1.0, steep).sum() / SUPERSAMPLED)
    return Drawn(np.dstack([eight_bit] * 3), x, line, length)


def srgb(linear: npt.ArrayLike) -> npt.NDArray[np.float64]:
    light = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
