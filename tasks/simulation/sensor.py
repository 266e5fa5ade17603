"""From gathered light to the picture that a camera stores: noise, colour, sharpening, sRGB."""

from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from schemas.camera import Camera

Floats = npt.NDArray[np.float32]
Image = npt.NDArray[np.uint8]

FULL_WELL = 7000.0  # electrons at which a photosite is full: a small drone's sensor
READ_NOISE = 4.0  # electrons
VIGNETTE = 0.25  # light lost in the corners
MEAN_LEVEL = 0.2  # linear, what automatic exposure brings the picture's mean to
FULL_SCALE = 4095.0  # of the 12-bit converter
SHARPEN = 0.45
SHARPEN_SIGMA_PX = 1.0


@lru_cache(maxsize=4)
def _vignette(camera: Camera) -> Floats:
    y, x = np.mgrid[: camera.height_px, : camera.width_px].astype(np.float32)
    cx, cy = camera.principal_px
    return np.asarray(1.0 - VIGNETTE * ((x - cx) ** 2 + (y - cy) ** 2) / (cx * cx + cy * cy), np.float32)


def automatic_gain(light: Floats) -> float:
    """Exposure that brings the mean to MEAN_LEVEL."""
    return MEAN_LEVEL / max(float(light[::8, ::8].mean()), 1e-6)


def develop(light: Floats, camera: Camera, gain: float, rng: np.random.Generator) -> Image:
    """(height, width, 3) sRGB of linear light behind an RGGB filter; saturation is at light · gain = 1."""
    electrons = light * _vignette(camera) * np.float32(gain * FULL_WELL)
    noise = rng.standard_normal(light.shape, dtype=np.float32)
    electrons += noise * np.sqrt(np.maximum(electrons, 0) + np.float32(READ_NOISE**2))
    raw = np.clip(np.rint(electrons * np.float32(FULL_SCALE / FULL_WELL)), 0, FULL_SCALE).astype(np.uint16)
    balance = 1.0 + rng.normal(0.0, 0.01, 2)  # red and blue: white balance is never perfect
    rgb = cv2.demosaicing(raw, cv2.COLOR_BayerRGGB2RGB_EA)
    curves = np.stack([_curve(b) for b in (balance[0], 1.0, balance[1])], axis=1)
    encoded = np.stack([curves[:, c][rgb[:, :, c]] for c in range(3)], axis=2)
    soft = cv2.GaussianBlur(encoded, (0, 0), SHARPEN_SIGMA_PX)
    sharp = cv2.addWeighted(encoded, 1.0 + SHARPEN, soft, -SHARPEN, 0.0)
    return np.asarray(cv2.convertScaleAbs(sharp, alpha=1.0 / 256.0))


def _curve(balance: float) -> npt.NDArray[np.uint16]:
    """(4096,) 12-bit linear to sRGB · 256."""
    linear = np.clip(np.arange(FULL_SCALE + 1) / FULL_SCALE * balance, 0.0, 1.0)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(srgb * 255.0 * 256.0), dtype=np.uint16)
