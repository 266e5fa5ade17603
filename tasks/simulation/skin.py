"""What a face looks like before light falls on it: reflectance, fine grain, marks. In linear light."""

from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from tasks.simulation.grain import fine_tile
from tasks.simulation.marks import Marks

Floats = npt.NDArray[np.float32]
Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Skin:
    """tone (rows, columns, 3) float32: reflectance 0..1 of waves longer than its texel, row 0 at v = 0;
    texel (r, c) is centred at v = r·texel_m, u = c·texel_m. grain: int8 tile of relative brightness × 127,
    sampled twice, the second time turned by `turn_deg`, so that nothing visible repeats. relief_m: (rows,
    columns) height of the surface over the face's plane, 0 rows where it is flat."""

    tone: Floats
    texel_m: float
    grain: npt.NDArray[np.int8]
    grain_texel_m: float
    turn_deg: float
    marks: Marks
    relief_m: Floats = field(default_factory=lambda: np.zeros((0, 0), np.float32))
    relief_texel_m: float = 1.0


def fine_grain(seed: int, octave_rms: float, stretch: float = 1.0) -> tuple[npt.NDArray[np.int8], float]:
    texel_m = 0.00025
    return fine_tile(seed, texel_m, octave_rms, stretch), texel_m


def streak(
    tone: Floats, texel_m: float, top_uv_m: tuple[float, float], size_m: tuple[float, float], factor: Rgb
) -> None:
    """Lay a soft streak that runs down from `top_uv_m` (rust, damp, lime) over `tone`, in place."""
    rows, columns = tone.shape[:2]
    u, v = top_uv_m
    width, length = size_m
    c0, c1 = (int(np.clip((u + k * 3 * width) / texel_m, 0, columns)) for k in (-1, 1))
    r0, r1 = (int(np.clip(x / texel_m, 0, rows)) for x in (v - length, v + width))
    if c1 <= c0 or r1 <= r0:
        return
    across = (np.arange(c0, c1) * texel_m - u) / width
    down = (v - np.arange(r0, r1) * texel_m) / length
    edge = 1.0 / (1.0 + np.exp(-np.clip(down / 0.03, -40, 40)))
    strength = edge * np.exp(-2.0 * np.maximum(down, 0.0))
    weight = (strength[:, None] * np.exp(-0.5 * across**2))[..., None].astype(np.float32)
    tone[r0:r1, c0:c1] *= 1.0 - weight * (1.0 - np.asarray(factor, dtype=np.float32))


def blotch(tone: Floats, texel_m: float, centre_m: tuple[float, float], radius_m: float, factor: Rgb) -> None:
    """Lay a soft round stain over `tone`, in place."""
    disc = np.zeros(tone.shape[:2], np.float32)
    centre = (round(centre_m[0] / texel_m), round(centre_m[1] / texel_m))
    cv2.circle(disc, centre, max(round(radius_m / texel_m), 1), 1.0, -1)
    weight = np.asarray(cv2.GaussianBlur(disc, (0, 0), max(0.35 * radius_m / texel_m, 0.8)))
    tone *= 1.0 - weight[..., None] * (1.0 - np.asarray(factor, dtype=np.float32))
