"""The paper's wall: wooden panels side by side, each with its own grain."""

import numpy as np

from tasks.simulation.crack import CrackShape
from tasks.simulation.face import Face
from tasks.simulation.grain import power_law
from tasks.simulation.marks import Shapes, in_cells
from tasks.simulation.skin import Rgb, Skin, blotch, fine_grain

TEXEL_M = 0.001
OCTAVE_RMS = 0.021
STRETCH = 12.0  # fibres are this much longer than wide
COLOUR: Rgb = (0.65, 0.52, 0.37)  # fresh plywood


def wood(
    face: Face,
    panels: tuple[tuple[float, float, float, float], ...],
    cracks: tuple[CrackShape, ...],
    other_marks: tuple[Shapes, ...],
    seed: int,
) -> Skin:
    """panels: (u, v, width, height) of each, metres. Fibres run along v."""
    rng = np.random.default_rng([seed, *face.name.encode()])
    shape = (int(face.height_m / TEXEL_M) + 2, int(face.width_m / TEXEL_M) + 2)
    tone = np.broadcast_to(np.asarray(COLOUR, dtype=np.float32), (*shape, 3)).copy()
    for u, v, width, height in panels:
        rows = slice(round(v / TEXEL_M), round((v + height) / TEXEL_M) + 1)
        columns = slice(round(u / TEXEL_M), round((u + width) / TEXEL_M) + 1)
        part = tone[rows, columns]
        size = part.shape[:2]
        fibres = power_law(rng, size, TEXEL_M, OCTAVE_RMS, stretch=STRETCH)
        clouds = power_law(rng, size, TEXEL_M, 0.4 * OCTAVE_RMS)
        rings = 0.03 * np.sin(_rings(rng, size))
        tint = 1.0 + rng.normal(0.0, 0.03, 3)
        part *= np.exp(fibres + clouds + rings)[..., None] * tint.astype(np.float32)
        for _ in range(rng.poisson(1.5)):  # knots
            centre = (rng.uniform(0, width), rng.uniform(0, height))
            blotch(part, TEXEL_M, centre, rng.uniform(0.008, 0.018), (0.62, 0.52, 0.42))
    tone = np.clip(tone, 0.01, 0.95)
    grain, grain_texel_m = fine_grain(seed, OCTAVE_RMS, 6.0)
    marks = in_cells([*other_marks, *(c.shapes for c in cracks)], face.width_m, face.height_m)
    return Skin(tone, TEXEL_M, grain, grain_texel_m, 3.0, marks)


def _rings(rng: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    """Phase of the growth rings: long flames along v."""
    v, u = np.mgrid[: size[0], : size[1]].astype(np.float32) * np.float32(TEXEL_M)
    warp = power_law(rng, size, TEXEL_M, 0.35, longest_m=0.6, stretch=5.0)
    pith = rng.uniform(0.1, 0.5)
    return np.asarray(2 * np.pi * np.hypot((u - pith) / 0.018, (v - 0.3) / 0.25) ** 0.9 + 3.0 * warp)
