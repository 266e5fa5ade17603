"""Crack width from the grey profile: a slit of width w and darkness D, blurred by the camera's PSF.

darkness(t) = D [Φ((t + w/2)/σ) − Φ((t − w/2)/σ)], in linear light.

From about five σ upwards the profile shows w and D apart (half-depth). Below, mostly their product: so D is
taken from where the same crack is wide, else from all its profiles together. Below about two σ, with nothing
wide to anchor D, only an upper bound can be said.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from tasks.measurement.profiles import STEP_PX, Profiles

WIDE_SIGMAS = 5.0  # from here w and D are told apart in each profile
UNRESOLVED_SIGMAS = 2.0  # below this, unanchored, only an upper bound
PALE = 0.5  # of the crack's darkness: what looks wide but paler is noise,
PALE_SURE = 2.0  # unless so many times a profile's usual error say that the crack is filled there
ANCHORS = 10  # so many wide profiles make an anchor
DARKEST = 1.0  # no crack returns less than no light
SHIFTS_PX = np.arange(-1.5, 1.51, 0.25)  # the profile's centre about the centreline
OVERSAMPLED = 1.0 / STEP_PX * 2.0  # neighbouring samples share pixels: their errors are not independent

Values = npt.NDArray[np.float64]


class Widths(NamedTuple):
    width_px: Values  # (N,)
    sigma_px: Values  # (N,) standard deviation
    is_upper_bound: bool


class _Match(NamedTuple):
    """How profiles compare with every template."""

    energy: Values  # (N,) of the profiles
    product: Values  # (N, W) profile · template, at the best shift
    template: Values  # (N, W) template · template, at that shift


def slit(offsets_px: Values, width_px: Values, sigma_px: float, shift_px: float = 0.0) -> Values:
    """(W, T) blurred slits of unit darkness."""
    t, half = offsets_px - shift_px, width_px[:, None] / 2
    return np.asarray(ndtr((t + half) / sigma_px) - ndtr((t - half) / sigma_px))


def products(profiles: Profiles, shapes: Values) -> Values:
    """(N, W) of (N, T) and (W, T). Not by BLAS: its sums depend on the number of threads."""
    return np.asarray(np.einsum("nt,wt->nw", profiles, shapes))


def measure_widths(offsets_px: Values, darkness: Profiles, psf_px: float, psf_sigma_px: float) -> Widths:
    """Width of each of (N, T) profiles of one crack, N ≥ 1. psf_sigma_px: 1σ of the blur."""
    widths = _grid(float(offsets_px[-1]))
    match = _compare(offsets_px, darkness, widths, psf_px)
    free = np.clip(match.product / match.template, 0.02, DARKEST)
    apart = _residual(match, free)
    best = apart.argmin(axis=1)
    rows = np.arange(len(darkness))
    wide = widths[best] >= WIDE_SIGMAS * psf_px
    told = free[rows, best]
    shared, spread, anchored = _shared_darkness(match, told[wide])
    together = _residual(match, np.full_like(free, shared))
    usual = float(np.median(apart[rows, best]))  # of a profile's squared error
    surely = together.min(axis=1) - apart[rows, best] > PALE_SURE * usual
    wide &= anchored & ((told > PALE * shared) | surely)
    width = np.where(wide, _refined(widths, apart), _refined(widths, together))
    noise = np.sqrt(apart[rows, best] / max(len(offsets_px) - 4, 1) * OVERSAMPLED)
    sigma = np.where(wide, 0.0, width * spread / shared)  # an error of D is one of w
    slope = np.maximum(shared * 2.0 / np.sqrt(2.0 * np.sqrt(np.pi) * psf_px / STEP_PX), 1e-6)
    # A narrow profile is as wide as √(w² + 12 σ²), of a box and a blur: where σ errs, w does.
    of_blur = 12.0 * psf_px * psf_sigma_px / np.maximum(width, 2.0 * psf_px)
    sigma = np.hypot(np.hypot(sigma, noise / slope), np.where(wide, 0.0, of_blur)) + 0.02
    typical = float(np.median(width))
    if not anchored and typical < UNRESOLVED_SIGMAS * psf_px:
        bound = max(typical, _upper_bound(offsets_px, darkness, widths, psf_px))
        return Widths(np.full(len(width), bound), np.full(len(width), bound / 2), True)
    return Widths(width, sigma, False)


def _grid(half_px: float) -> Values:
    """Widths to try: fine where they are small."""
    fine, coarse = np.arange(0.1, 4.0, 0.1), np.arange(4.0, max(4.3, 1.2 * half_px), 0.25)
    return np.concatenate([fine, coarse])


def _compare(offsets_px: Values, darkness: Profiles, widths: Values, psf_px: float) -> _Match:
    """The best shift for each profile and width. Constant offsets (the background's error) do not count."""
    level = darkness - darkness.mean(axis=1, keepdims=True)
    best: Values = np.full((len(darkness), len(widths)), -np.inf)
    product, template = np.zeros_like(best), np.ones_like(best)
    for shift in SHIFTS_PX:
        shapes = slit(offsets_px, widths, psf_px, float(shift))
        shapes = shapes - shapes.mean(axis=1, keepdims=True)
        size = (shapes * shapes).sum(axis=1)
        seen = products(level, shapes)
        better = np.sign(seen) * seen**2 / size > best
        best = np.where(better, np.sign(seen) * seen**2 / size, best)
        product, template = np.where(better, seen, product), np.where(better, size, template)
    return _Match((level * level).sum(axis=1), product, template)


def _residual(match: _Match, darkness: Values) -> Values:
    """(N, W) squared error of the templates at these darknesses."""
    squared = match.energy[:, None] - 2 * darkness * match.product + darkness**2 * match.template
    return np.asarray(np.maximum(squared, 1e-12))


def _shared_darkness(match: _Match, of_wide: Values) -> tuple[float, float, bool]:
    """D of the whole crack, its standard deviation, and whether wide profiles anchor it. They do where there
    are enough and where the others agree: among many narrow profiles noise makes some look wide and pale."""
    tried = np.linspace(0.04, DARKEST, 97)
    errors = np.array([_residual(match, np.full_like(match.product, d)).min(axis=1).sum() for d in tried])
    best, free = int(errors.argmin()), len(match.energy) / OVERSAMPLED
    within = tried[errors <= errors[best] * (1 + 4.0 / max(free, 4.0))]
    if len(of_wide) >= min(ANCHORS, len(match.energy)):
        middle = float(np.median(of_wide))
        if within[0] <= middle <= within[-1]:
            spread = 1.4826 * float(np.median(np.abs(of_wide - middle)))
            return middle, max(spread / np.sqrt(len(of_wide) / OVERSAMPLED), 0.01), True
    return float(tried[best]), max(float(np.ptp(within)) / 4.0, 0.01), False


def _refined(widths: Values, errors: Values) -> Values:
    """Width of the least error of each row, between the grid's steps by a parabola."""
    at = np.clip(errors.argmin(axis=1), 1, len(widths) - 2)
    rows = np.arange(len(errors))
    x = np.stack([widths[at - 1], widths[at], widths[at + 1]])
    y = np.stack([errors[rows, at - 1], errors[rows, at], errors[rows, at + 1]])
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    bend = (right - left) / (x[2] - x[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        lowest = (x[0] + x[1]) / 2 - left / (2 * bend)
    return np.asarray(np.where(bend > 1e-12, np.clip(lowest, x[0] * 0.5, x[2]), x[1]))


def _upper_bound(offsets_px: Values, darkness: Profiles, widths: Values, psf_px: float) -> float:
    """The largest width whose blurred slit still fits the crack's mean profile."""
    mean = darkness.mean(axis=0, keepdims=True)
    match = _compare(offsets_px, mean, widths, psf_px)
    errors = _residual(match, np.clip(match.product / match.template, 0.02, DARKEST))[0]
    fits = widths[errors <= 2.0 * errors.min() + 1e-6]
    return float(fits.max())
