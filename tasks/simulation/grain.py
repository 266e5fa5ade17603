"""Noise with the spectrum of real surfaces.

Measured on 264 crack-free patches (160×160 px) of 126 wall and concrete photos of the CC0 set `uav`
(development data), logarithm of linear light, plane taken off; 10th, 50th, 90th percentile:
slope of the 2D power spectrum −2.7, −2.15, −1.7; RMS 0.11, 0.19, 0.41; RMS after a high pass of σ = 6 px
0.07, 0.13, 0.23; excess kurtosis of that 0.7, 3.1, 10; skewness −0.5, 0.5, 1.6. A slope near −2 means about
the same variance in every octave.
"""

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy import fft

Floats = npt.NDArray[np.float32]

SPECTRUM_SLOPE = -2.15
LONGEST_M = 1.5  # the spectrum is flat for longer waves: no surface grows ever darker
USUAL_PER_M = 50.0  # `octave_rms` is that of waves of 2 cm; it changes little over the octaves
TILE = 2048  # texels of a fine tile's side; it repeats
FINE_LONGEST_M = 0.008  # longest wave in a fine tile; the unique map of a face holds the longer ones


def power_law(
    rng: np.random.Generator,
    shape: tuple[int, int],
    texel_m: float,
    octave_rms: float,
    longest_m: float = LONGEST_M,
    stretch: float = 1.0,
) -> Floats:
    """Gaussian noise (rows, columns) whose 2D power falls as frequency^SPECTRUM_SLOPE, with about
    `octave_rms` in each octave. stretch > 1 draws it out along the rows' axis (v), as grain of wood."""
    rows, columns = (fft.next_fast_len(n + round(0.1 / texel_m), real=True) for n in shape)
    white = rng.standard_normal((rows, columns), dtype=np.float32)
    fv = np.fft.fftfreq(rows, texel_m)[:, None].astype(np.float32) * np.float32(stretch)
    fu = np.fft.rfftfreq(columns, texel_m)[None, :].astype(np.float32)
    f = np.maximum(np.hypot(fu, fv), np.float32(1.0 / longest_m))
    # ∫ amplitude² 2πf df over an octave around f0 = octave_rms², with texel_m² the area of a sample
    density = octave_rms**2 / (2 * np.pi * np.log(2.0)) * stretch
    amplitude = np.sqrt(density) * f ** np.float32(-1.0) / texel_m
    amplitude *= (f / np.float32(USUAL_PER_M)) ** np.float32((SPECTRUM_SLOPE + 2.0) / 2)
    spectrum = fft.rfft2(white) * amplitude
    spectrum[0, 0] = 0.0
    noise = fft.irfft2(spectrum, s=(rows, columns))
    return np.ascontiguousarray(noise[: shape[0], : shape[1]], dtype=np.float32)


@lru_cache(maxsize=8)
def fine_tile(seed: int, texel_m: float, octave_rms: float, stretch: float) -> npt.NDArray[np.int8]:
    """(TILE, TILE) int8: relative brightness × 127 of waves shorter than FINE_LONGEST_M, periodic."""
    rng = np.random.default_rng([seed, 0x47726169])
    white = rng.standard_normal((TILE, TILE), dtype=np.float32)
    fv = np.fft.fftfreq(TILE, texel_m)[:, None].astype(np.float32)
    fu = np.fft.rfftfreq(TILE, texel_m)[None, :].astype(np.float32)
    f = np.maximum(np.hypot(fu, fv * np.float32(stretch)), np.float32(1e-3))
    density = octave_rms**2 / (2 * np.pi * np.log(2.0)) * stretch
    high_pass = 1.0 - np.exp(-((f * np.float32(FINE_LONGEST_M)) ** 2) / 2)
    spectrum = fft.rfft2(white) * (np.sqrt(density) / texel_m / f * high_pass)
    noise = np.exp(fft.irfft2(spectrum, s=(TILE, TILE)))
    noise /= noise.mean()
    return np.asarray(np.clip(np.rint((noise - 1.0) * 127.0), -127, 127), dtype=np.int8)
