"""Cracks of one image: from a mask to centrelines, lengths, widths and directions, in pixels."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from schemas.bit_mask import BitMask
from schemas.raster import Progress, Raster
from tasks.measurement.centreline import Points, arc_length, normals, orientation_deg, smooth, straight_ends
from tasks.measurement.profiles import STEP_PX, Across, across
from tasks.measurement.psf import Psf, estimated_psf
from tasks.measurement.skeleton import Path, crack_paths
from tasks.measurement.thickness import thickness_px
from tasks.measurement.width_profile import Widths, measure_widths

LEAST_HALF_PX = 8.0  # half length of a profile
FINE_HALF_PX = 60.0  # longer profiles are sampled as much more coarsely: a wide crack costs no more than this
LEAST_PSF_PX = 0.4  # of such a profile's own, longer pixels
BESIDE_PX = 6.0  # of a profile lie beyond the crack's edges, at least
MET_PX = 3.0  # from the end of a branch to the axis that it starts at
BLURRED_PX = 2.0  # beyond its edges a crack still darkens what lies beside it
FAINTEST = 0.03  # median darkness of a crack in linear light: what is fainter is no crack


class MeasuredCrack(NamedTuple):
    centreline: Points  # (N, 2) steps of about 1 px
    along_px: npt.NDArray[np.float64]  # (N,)
    widths: Widths
    network: int

    @property
    def length_px(self) -> float:
        return float(self.along_px[-1])

    @property
    def orientation_deg(self) -> float:
        return orientation_deg(self.centreline)

    @property
    def middle_px(self) -> tuple[float, float]:
        at = int(np.searchsorted(self.along_px, self.length_px / 2))
        return float(self.centreline[at, 0]), float(self.centreline[at, 1])


class MeasuredImage(NamedTuple):
    cracks: list[MeasuredCrack]  # by position: left to right, then top to bottom
    rejected: list[tuple[tuple[float, float], str]]
    psf_px: float


class _Line(NamedTuple):
    centreline: Points
    profiles: Across
    coarser: float  # 1 or more: the profiles' pixels are as many times longer than the image's
    network: int
    width_px: float  # of the mask there


class _Core(NamedTuple):
    """What of a crack its branches lie in at first."""

    axis: cKDTree
    width_px: float


def measure_cracks(
    raster: Raster, mask: BitMask, least_px: float, gap_px: float, on_progress: Progress | None = None
) -> MeasuredImage:
    """mask: crack pixels of the raster. Paths shorter than `least_px` are no cracks; gaps of up to
    `gap_px` within a crack are bridged."""
    lines, rejected = [], []
    paths = crack_paths(mask, least_px, gap_px)
    met, cores = _met_at_ends(paths), list[_Core]()
    for n, path in enumerate(paths):
        line = _line(raster, path, mask)
        within = np.zeros(len(line.centreline), bool)
        for core in (cores[m] for m in met[n]):
            away, _ = core.axis.query(line.centreline)
            within |= away < (core.width_px + line.width_px) / 2 + BLURRED_PX
        cores.append(_Core(cKDTree(line.centreline), line.width_px))
        line = line._replace(profiles=line.profiles._replace(usable=line.profiles.usable & ~within))
        middle = path.points[len(path.points) // 2]
        position = (float(middle[0]), float(middle[1]))
        if line.profiles.usable.sum() < 3 and within.any():
            rejected.append((position, "hardly leaves the crack that it branches from"))
        elif line.profiles.usable.sum() < 3:
            rejected.append((position, "at the rim of what the photos cover"))
        elif np.median(_peak(line.profiles)) < FAINTEST:
            rejected.append((position, "no darker than what lies beside it"))
        else:
            lines.append(line)
        if on_progress is not None:
            on_progress((n + 1) / len(paths))
    psf = estimated_psf(
        [(p.offsets_px, p.darkness[p.usable]) for _, p, coarser, _, _ in lines if coarser == 1.0]
    )
    cracks = [_measured(line, psf) for line in lines]
    return MeasuredImage(sorted(cracks, key=lambda crack: crack.middle_px), rejected, psf.px)


def _line(raster: Raster, path: Path, mask: BitMask) -> _Line:
    """Centreline through the darkest of the profiles, and the profiles across it."""
    width = float(np.percentile(thickness_px(mask, path.points), 75))
    half = max(width + BESIDE_PX, LEAST_HALF_PX)
    coarser = max(1.0, half / FINE_HALF_PX)
    centreline = smooth(straight_ends(path.points, round(width / 2), mask))
    profiles = across(raster, centreline, half, coarser * STEP_PX)
    near = np.abs(profiles.offsets_px) <= width / 2 + 2.0
    dark = np.maximum(profiles.darkness[:, near], 0.0)
    shift = (dark * profiles.offsets_px[near]).sum(axis=1) / np.maximum(dark.sum(axis=1), 1e-3)
    shift = gaussian_filter1d(np.where(profiles.usable, shift, 0.0), 3.0, mode="nearest")
    centreline = smooth(centreline + shift[:, None] * normals(centreline))
    profiles = across(raster, centreline, half, coarser * STEP_PX)
    return _Line(centreline, profiles, coarser, path.network, width)


def _met_at_ends(paths: Sequence[Path]) -> list[list[int]]:
    """Of each path those before it, the longer ones of its network, that it begins or ends at: within these
    it has no width of its own."""
    if not paths:
        return []
    owner = np.repeat(np.arange(len(paths)), [len(path.points) for path in paths])
    tree = cKDTree(np.concatenate([path.points for path in paths]))
    met = []
    for n, path in enumerate(paths):
        near = tree.query_ball_point(path.points[[0, -1]], MET_PX)
        found = {int(owner[k]) for some in near for k in some}
        met.append(sorted(m for m in found if m < n and paths[m].network == path.network))
    return met


def _peak(profiles: Across) -> npt.NDArray[np.float64]:
    """Darkness in the middle of each profile."""
    middle = np.abs(profiles.offsets_px) <= 1.0
    return np.asarray(profiles.darkness[np.ix_(profiles.usable, middle)].mean(axis=1))


def _measured(line: _Line, psf: Psf) -> MeasuredCrack:
    profiles, coarser = line.profiles, line.coarser
    blur_px = psf.px if coarser == 1.0 else max(psf.px / coarser, LEAST_PSF_PX)
    darkness = profiles.darkness[profiles.usable]
    known = measure_widths(profiles.offsets_px / coarser, darkness, blur_px, psf.sigma_px / coarser)
    along = arc_length(line.centreline)
    width, sigma = (  # what lies on unknown pixels takes the width of its neighbours
        np.interp(along, along[profiles.usable], coarser * values)
        for values in (known.width_px, known.sigma_px)
    )
    widths = Widths(width, sigma, known.is_upper_bound)
    return MeasuredCrack(line.centreline, along, widths, line.network)
