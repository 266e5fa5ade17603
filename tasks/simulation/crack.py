"""Cracks of known centreline and width.

A crack wanders as real ones do, its width is correlated along its length and tapers to nothing, its edges are
chipped, its darkness changes; branches leave it at an angle. The centreline is smooth below SMOOTH_M, so that
its length does not depend on the scale at which it is looked at.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d

from tasks.simulation.marks import Shapes, segments

Array = npt.NDArray[np.float64]

STEP_M = 0.001
SMOOTH_M = 0.005
# RMS of the heading in degrees at each correlation length: crack paths are self-affine, they go around grains
# of every size. Along the centrelines of 352 photos (uav, DeepCrack) each chord turns from the last by 19 to
# 26° RMS, be they 8, 16, 32 or 64 px long, through junctions too; ours, without any, by 13 to 18°
# (`make bench-detection`, part turns).
WANDER_DEG = {0.04: 12.0, 0.02: 9.0, 0.01: 10.5, 0.005: 13.0}
WIDTH_SIGMA = 0.15  # RMS of ln(width) along the crack
WIDTH_LENGTH_M = 0.06
EDGE_RMS = 0.05  # of each edge's roughness, in crack widths
CHIPS_PER_M = 12.0
SAMPLE_M = 0.003  # spacing of the widths in the truth; each is the mean over this length


@dataclass(frozen=True)
class CrackShape:
    """A crack on a face. N points STEP_M apart; `left` and `right` are the edges' distances from it."""

    id: str
    parent: str | None  # of a branch
    uv_m: Array  # (N, 2) in the frame of its face
    left_m: Array  # (N,)
    right_m: Array  # (N,)
    kept_light: Array  # (N,) share of the surface's brightness inside the crack

    @property
    def shapes(self) -> Shapes:
        return segments(self.uv_m, self.left_m, self.right_m, self.kept_light)

    @property
    def length_m(self) -> float:
        return float(np.linalg.norm(np.diff(self.uv_m, axis=0), axis=1).sum())

    def sampled(self) -> tuple[Array, Array]:
        """(M, 2) points SAMPLE_M apart (and the end), (M,) widths in metres averaged around each."""
        every = round(SAMPLE_M / STEP_M)
        box = np.ones(every) / every
        width = self.left_m + self.right_m
        mean = np.convolve(np.pad(width, every // 2, mode="edge"), box, mode="valid")[: len(width)]
        index = np.unique(np.r_[np.arange(0, len(width), every), len(width) - 1])
        return self.uv_m[index], mean[index]


def crack(
    rng: np.random.Generator,
    id: str,
    start_uv_m: tuple[float, float],
    heading_deg: float,
    length_m: float,
    width_m: float,
    *,
    open_end: Literal["start", "none"] = "none",
    darkness: float | None = None,
    parent: str | None = None,
) -> CrackShape:
    """heading_deg: 0 along +u, counter-clockwise. width_m: about its median where it is not tapering.
    open_end "start": it begins at full width, as a branch or at an edge does."""
    n = max(round(length_m / STEP_M), 20)
    wander_deg = sum((deg * _correlated(rng, n, length) for length, deg in WANDER_DEG.items()), np.zeros(n))
    heading = np.radians(heading_deg + wander_deg)
    heading -= np.linspace(0, 1, n) * (heading.mean() - np.radians(heading_deg))
    steps = STEP_M * np.column_stack([np.cos(heading), np.sin(heading)])
    uv = np.asarray(start_uv_m) + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    s = np.linspace(0.0, 1.0, n + 1)
    taper = np.minimum(1.0, (1.0 - s) / 0.15) ** 0.7
    if open_end == "none":
        taper *= np.minimum(1.0, s / 0.12) ** 0.7
    width = width_m * taper * np.exp(WIDTH_SIGMA * _correlated(rng, n + 1, WIDTH_LENGTH_M))
    left, right = (_edge(rng, width) for _ in range(2))
    usual = float(np.interp(width_m, [0.0005, 0.001, 0.003], [0.55, 0.65, 0.85]))
    depth = (darkness or usual) + 0.04 * _correlated(rng, n + 1, 0.05)
    return CrackShape(id, parent, uv, left, right, 1.0 - np.clip(depth, 0.3, 0.95))


def branch(
    rng: np.random.Generator, trunk: CrackShape, at: float, length_m: float, share: float
) -> CrackShape:
    """A branch that leaves `trunk` at the share `at` of its length, `share` times as wide."""
    index = int(at * (len(trunk.uv_m) - 1))
    along = trunk.uv_m[index] - trunk.uv_m[max(index - 10, 0)]
    side = rng.choice([-1.0, 1.0]) * rng.uniform(35.0, 55.0)
    heading = float(np.degrees(np.arctan2(along[1], along[0]))) + side
    width_m = float(np.median(trunk.left_m + trunk.right_m)) * share
    start = (float(trunk.uv_m[index, 0]), float(trunk.uv_m[index, 1]))
    return crack(
        rng,
        f"{trunk.id}b",
        start,
        heading,
        length_m,
        width_m,
        open_end="start",
        darkness=float(1.0 - trunk.kept_light.mean()),
        parent=trunk.id,
    )


def _correlated(rng: np.random.Generator, n: int, length_m: float) -> Array:
    """(n,) unit-variance Gaussian noise with this correlation length (never below SMOOTH_M)."""
    sigma = max(length_m, SMOOTH_M) / STEP_M / np.sqrt(2)
    pad = int(4 * sigma)
    noise = gaussian_filter1d(rng.standard_normal(n + 2 * pad), sigma)[pad : pad + n]
    return np.asarray(noise * np.sqrt(2 * np.sqrt(np.pi) * sigma))


def _edge(rng: np.random.Generator, width_m: Array) -> Array:
    """(n,) distances of one edge: half the width, rough, with chips knocked out of it."""
    n = len(width_m)
    edge = width_m * (0.5 + EDGE_RMS * gaussian_filter1d(rng.standard_normal(n), 1.0) * 1.9)
    for _ in range(rng.poisson(CHIPS_PER_M * n * STEP_M)):
        at, half, depth = rng.integers(n), rng.uniform(1.5, 4.0), rng.uniform(0.08, 0.25)
        distance = (np.arange(n) - at) / half
        edge += depth * width_m[at] * np.maximum(0.0, 1.0 - distance**2)
    return np.asarray(np.maximum(edge, 0.0))
