"""Concrete as it comes out of its formwork: noise of the right spectrum, pores, board joints, tie holes,
stains, rust and lime. Drawn from a seed in the coordinates of the face, so that every photo sees the same."""

from itertools import pairwise

import numpy as np

from tasks.simulation.crack import CrackShape
from tasks.simulation.face import Face
from tasks.simulation.grain import power_law
from tasks.simulation.marks import Shapes, discs, in_cells, line
from tasks.simulation.skin import Floats, Rgb, Skin, blotch, fine_grain, streak

TEXEL_M = 0.002
OCTAVE_RMS = 0.05  # as-struck concrete: the smoothest tenth of what grain.py measured
PORES_PER_M2 = 160.0
PANEL_M = 2.4  # formwork board
COLOUR: Rgb = (0.41, 0.40, 0.375)
RUST: Rgb = (0.80, 0.66, 0.52)
DAMP: Rgb = (0.72, 0.72, 0.73)
LIME: Rgb = (1.25, 1.26, 1.27)


def plain(face: Face, seed: int, colour: Rgb, octave_rms: float = OCTAVE_RMS) -> Skin:
    """A face that is only background: coarse noise and grain, no marks."""
    rng = np.random.default_rng([seed, *face.name.encode()])
    texel_m = max(0.01, max(face.width_m, face.height_m) / 1500)
    tone = _tone(rng, face, texel_m, colour, octave_rms)
    grain, grain_texel_m = fine_grain(seed, octave_rms)
    return Skin(tone, texel_m, grain, grain_texel_m, 33.0, in_cells([], face.width_m, face.height_m))


def concrete(face: Face, cracks: tuple[CrackShape, ...], seed: int) -> Skin:
    rng = np.random.default_rng([seed, *face.name.encode()])
    tone = _tone(rng, face, TEXEL_M, COLOUR, OCTAVE_RMS)
    joints = joint_positions_m(face)
    for before, after in pairwise((0.0, *joints, face.width_m)):  # each board its own tone
        tone[:, round(before / TEXEL_M) : round(after / TEXEL_M)] *= 1.0 + rng.normal(0.0, 0.025)
    holes = tie_holes_m(face, joints)
    upright = abs(face.normal[2]) < 0.5
    for u, v in holes:
        if upright and rng.random() < 0.4:
            length = rng.uniform(0.2, 0.6)
            streak(tone, TEXEL_M, (u, v), (rng.uniform(0.012, 0.025), length), RUST)
    for _ in range(rng.poisson(0.5 * face.width_m * face.height_m)):
        centre = (rng.uniform(0, face.width_m), rng.uniform(0, face.height_m))
        blotch(tone, TEXEL_M, centre, rng.uniform(0.04, 0.2), DAMP if rng.random() < 0.7 else LIME)
    for crack in cracks:
        if upright and crack.parent is None and rng.random() < 0.5:
            u, v = crack.uv_m[int(0.4 * len(crack.uv_m))]
            streak(tone, TEXEL_M, (u, v), (0.02, rng.uniform(0.15, 0.4)), LIME)
    grain, grain_texel_m = fine_grain(seed, OCTAVE_RMS)
    shapes = [
        _pores(rng, face),
        *_ties(holes),
        *(_joint(face, u) for u in joints),
        *(c.shapes for c in cracks),
    ]
    return Skin(tone, TEXEL_M, grain, grain_texel_m, 33.0, in_cells(shapes, face.width_m, face.height_m))


def joint_positions_m(face: Face) -> tuple[float, ...]:
    """u of the joints between the formwork boards: a line that is no crack."""
    boards = max(round(face.width_m / PANEL_M), 1)
    return tuple(face.width_m * k / boards for k in range(1, boards))


def tie_holes_m(face: Face, joints: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
    """Plugged holes of the formwork ties, in a row along each board's middle."""
    edges = (0.0, *joints, face.width_m)
    middles = [(a + b) / 2 for a, b in pairwise(edges)]
    heights = np.arange(0.45, face.height_m - 0.2, 1.2)
    return tuple((u, float(v)) for u in middles for v in heights)


def _tone(rng: np.random.Generator, face: Face, texel_m: float, colour: Rgb, octave_rms: float) -> Floats:
    shape = (int(face.height_m / texel_m) + 2, int(face.width_m / texel_m) + 2)
    brightness = np.exp(power_law(rng, shape, texel_m, octave_rms))
    warmth = 0.15 * power_law(rng, shape, texel_m, octave_rms, longest_m=0.5)
    tone = brightness[..., None] * np.asarray(colour, dtype=np.float32)
    tone[..., 0] *= 1.0 + warmth
    tone[..., 2] *= 1.0 - warmth
    return np.asarray(np.clip(tone, 0.01, 0.95), dtype=np.float32)


def _pores(rng: np.random.Generator, face: Face) -> Shapes:
    """Air voids: many small ones, few large (radius 0.7 mm upwards, power law), never line-like."""
    n = rng.poisson(PORES_PER_M2 * face.width_m * face.height_m)
    uv = rng.uniform(0, 1, (n, 2)) * (face.width_m, face.height_m)
    radius = np.minimum(0.0007 * (1 - rng.uniform(0, 1, n)) ** (-1 / 2.5), 0.006)
    return discs(uv, radius, rng.uniform(0.35, 0.75, n))


def _ties(holes: tuple[tuple[float, float], ...]) -> list[Shapes]:
    if not holes:
        return []
    uv = np.asarray(holes)
    rim, plug = np.full(len(uv), 0.013), np.full(len(uv), 0.011)
    return [discs(uv, rim, np.full(len(uv), 0.55)), discs(uv, plug, np.full(len(uv), 1.35))]


def _joint(face: Face, u: float) -> Shapes:
    return line((u, 0.0), (u, face.height_m), 0.0015, 0.78)
