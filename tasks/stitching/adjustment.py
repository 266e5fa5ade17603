"""Bundle adjustment of plane-induced cameras: what makes a mosaic metric.

Unknown: eight numbers a photo (rotation, position, rolling shutter), focal length, k1 and principal point per
camera, the positions' common error, two coordinates per track on the surface and its height over it.
Residuals are pixels of the photos as taken, so nothing is gained by shrinking the mosaic: what is left free
is a similarity, which the priors hold. How much a rolling shutter may do, and how far points stand off the
surface, is learnt from all photos together, where they tell of it at all: free to do anything in each, a
shutter would make them free homographies, which are not metric.
Levenberg-Marquardt with Cauchy weights; tracks are eliminated (Schur complement, Triggs et al. 2000, section
6), photos remain as a banded system."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tasks.stitching.bundle import (
    ALIKE,
    ON_SURFACE,
    Bundle,
    State,
    build_bundle,
    camera_key,
    height_squares,
    height_weight,
    linearise,
    met,
    nominal_lens,
    prior_errors,
    residuals,
    sigma_lens,
)
from tasks.stitching.heights import Heights, heights_in, learnt_spread, told_spread
from tasks.stitching.normal_equations import damped_step
from tasks.stitching.prior import Prior
from tasks.stitching.rays import points
from tasks.stitching.shutter import NO_ROLL, expected_roll, learnt_roll
from tasks.stitching.tracks import Observations
from tasks.stitching.uncertainty import Certainty, certainty_of, noise
from tasks.stitching.view import Array, View

# Each round adjusts, then drops outliers. Residuals are taken for at least this uncertain (px): wide weights
# first, since narrow ones freeze whatever the first guess got wrong; SIFT is not better than the last.
LEAST_SIGMA_PX = (2.0, 0.5, 0.1)
ITERATIONS = 40
# Fall of the cost, where one sigma of one unknown costs 1: the last round's answer counts, the others' guess.
CONVERGED = (1.0, 1.0, 0.1)
LEAST_DAMPING = 1e-11  # more would hold back what the photos all share, which they hardly tell
CAUCHY = 2.5  # residuals of this many sigma count half
OUTLIER = 5.0  # and those of this many are dropped at the end
LARGEST_ROLL = 0.004  # of the photo's height: 1σ of a rolling shutter's effect before any was seen
FAR = 3.0  # positions off by so many sigma count half: some photo bears another's


@dataclass(frozen=True)
class Adjusted:
    views: tuple[View, ...]  # with adjusted cameras; as given where the photo was not observed
    observations: Observations  # without outliers
    residual_px: Array  # (M, 2)
    sigma_px: float  # of one coordinate, robust
    bias: Array  # (3,) common error of the prior positions
    certainty: Certainty  # of the photos that `observations` see, in their order
    heights: Heights | None  # of the points over the surface, where the photos tell of any


def adjust(
    views: Sequence[View],
    observations: Observations,
    priors: Sequence[Prior],
    sigma_bias: Array,
    focal_sigmas: Sequence[float],
    on_progress: Callable[[float], None],
    surface_known: bool = False,
) -> Adjusted:
    """Cameras of all photos that are observed. `views` are first guesses; surface_known: points lie on it."""
    seen = np.unique(observations.photo)
    index = np.full(len(views), -1)
    index[seen] = np.arange(len(seen))
    own, own_priors = [views[i] for i in seen], [priors[i] for i in seen]
    current = replace(observations, photo=index[observations.photo])
    cameras = tuple({camera_key(v.camera): v.camera for v in own}.values())
    state = State(
        R=np.stack([v.R for v in own]),
        C=np.stack([v.C for v in own]),
        roll=np.zeros((len(own), 2)),
        lens=nominal_lens(cameras),
        bias=np.zeros(3),
        X=np.zeros((0, 2)),
        w=np.zeros(0),
    )
    sigma, residual, variance = 0.0, np.zeros((0, 2)), ALIKE * LEAST_SIGMA_PX[0] ** 2
    sigma_roll = np.full(2, LARGEST_ROLL * max(c.height_px for c in cameras))
    expected, spread = np.zeros_like(state.roll), ON_SURFACE
    for round_, (least_sigma, converged) in enumerate(zip(LEAST_SIGMA_PX, CONVERGED, strict=True)):
        sigmas = [focal_sigmas[i] for i in seen]
        while True:
            bundle = build_bundle(own, cameras, current, own_priors, sigma_bias, sigmas, sigma_roll, expected)
            bundle = replace(bundle, spread=spread)
            X, w = points(state, bundle, sigma)
            state = replace(state, X=X, w=w)
            seen_well = met(state, bundle)
            if seen_well.all():
                state, residual, sigma = _iterate(state, bundle, least_sigma, variance, converged)
                seen_well = met(state, bundle)
                if seen_well.all():
                    break
            current = current.where(seen_well)
        weight, trust = _robust(residual, sigma), _trust(state, bundle)
        variance = noise(bundle, residual, weight)
        on_progress((round_ + 1) / len(LEAST_SIGMA_PX))
        # Among free heights few points err; those of a photo that shows much else, trees, are its own still.
        usual = sigma if spread == ON_SURFACE else LEAST_SIGMA_PX[0]
        good = np.linalg.norm(residual, axis=1) < OUTLIER * usual
        if round_ < len(LEAST_SIGMA_PX) - 1:
            current = current.where(good)
        if round_ == 0 and not surface_known:
            spread, noise_px = told_spread(state, bundle, weight)
            variance = variance if spread == ON_SURFACE else noise_px**2
        if round_ == len(LEAST_SIGMA_PX) - 2:
            if spread != ON_SURFACE:
                spread = learnt_spread(state, bundle, weight / variance)
            if _is_told(state, bundle, least_sigma, variance):
                expected = expected_roll(state, bundle)
                sigma_roll = learnt_roll(state, bundle, expected, weight / variance, trust)
                # Again: free as they were, the rolls took over what a slant of the whole does to each photo.
                bundle = replace(bundle, sigma_roll=sigma_roll, expected_roll=expected)
                state, residual, sigma = _iterate(state, bundle, least_sigma, variance, converged)
                weight, trust = _robust(residual, sigma), _trust(state, bundle)
                sigma_roll = learnt_roll(state, bundle, expected, weight / variance, trust)
            else:
                sigma_roll, state = NO_ROLL, replace(state, roll=np.zeros_like(state.roll))
    adjusted = list(views)
    for k, i in enumerate(seen):
        adjusted[i] = bundle.view(state, k)
    certainty = certainty_of(state, bundle, weight / variance, trust)
    kept = replace(current, photo=seen[current.photo])
    heights = heights_in(state, bundle, weight / variance)
    return Adjusted(tuple(adjusted), kept, residual, sigma, state.bias, certainty, heights)


def _is_told(state: State, bundle: Bundle, least_sigma: float, variance: float) -> bool:
    """Whether the photos tell of a rolling shutter: residuals without one cost more than its two numbers a
    photo may, ln(observations) each (Schwarz 1978). Taken for one where there is none, a wall's height would
    hang on noise: in photos that are all upright a shutter's pull is a stretch of the whole."""
    stiff = replace(bundle, sigma_roll=NO_ROLL)
    start = replace(state, roll=np.zeros_like(state.roll))
    own, may_cost = residuals(state, bundle), np.log(len(bundle.xy)) * state.roll.size
    enough = _cost(state, bundle, own, max(_sigma(own), least_sigma), variance) + may_cost
    without, residual, _ = _iterate(start, stiff, least_sigma, variance, CONVERGED[-1], enough)
    sigma = max(_sigma(residual), least_sigma)
    saved = _cost(without, stiff, residual, sigma, variance) - _cost(state, bundle, own, sigma, variance)
    return bool(saved > may_cost)


def _iterate(
    state: State,
    bundle: Bundle,
    least_sigma: float,
    variance: float,
    converged: float,
    enough: float = -np.inf,
) -> tuple[State, Array, float]:
    """To the minimum, or to where the cost is low `enough`; residuals (M, 2) and their robust sigma there.
    variance: of a coordinate of a fully trusted observation, as if all were independent (px²)."""
    damping = 1e-4
    residual, jacobians = linearise(state, bundle)
    for _ in range(ITERATIONS):
        sigma = max(_sigma(residual), least_sigma)
        cost = _cost(state, bundle, residual, sigma, variance)
        if cost < enough:
            break
        while True:
            weight, trust = _robust(residual, sigma) / variance, _trust(state, bundle)
            candidate = damped_step(state, bundle, residual, jacobians, weight, trust, damping)
            new_residual = residuals(candidate, bundle)
            new_cost = _cost(candidate, bundle, new_residual, sigma, variance)
            if new_cost <= cost or damping > 1e8:
                break
            damping *= 8.0
        if not new_cost <= cost:
            break
        state, damping = candidate, max(damping / 10.0, LEAST_DAMPING)
        residual, jacobians = linearise(state, bundle)
        if cost - new_cost < converged and damping <= LEAST_DAMPING:
            break
    return state, residual, max(_sigma(residual), least_sigma)


def _sigma(residual: Array) -> float:
    """Of one coordinate, from the median length (Rayleigh: 1.177 σ)."""
    lengths = np.linalg.norm(np.nan_to_num(residual, nan=1e6), axis=1)
    return float(np.median(lengths)) / 1.1774


def _robust(residual: Array, sigma: float) -> Array:
    """(M,) share of each observation that counts, 0..1."""
    return np.asarray(1.0 / (1.0 + _squares(residual, sigma)))


def _trust(state: State, bundle: Bundle) -> Array:
    """(n,) of the prior positions, 0..1."""
    return np.asarray(1.0 / (1.0 + _far(state, bundle)))


def _squares(residual: Array, sigma: float) -> Array:
    """(M,) squared lengths in units of where they count half."""
    return np.asarray((residual**2).sum(axis=1) / (CAUCHY * sigma) ** 2)


def _far(state: State, bundle: Bundle) -> Array:
    """(n,) squared distances from the prior positions in units of where they count half."""
    _, moved = prior_errors(state, bundle)
    return np.asarray((bundle.weight_position * moved**2).sum(axis=1) / FAR**2)


def _cost(state: State, bundle: Bundle, residual: Array, sigma: float, variance: float) -> float:
    """Twice the negative logarithm of the likelihood, but for a constant."""
    if not np.isfinite(residual).all():
        return float("inf")
    turned, _ = prior_errors(state, bundle)
    terms = (
        (CAUCHY * sigma) ** 2 / variance * np.log1p(_squares(residual, sigma)).sum(),
        FAR**2 * np.log1p(_far(state, bundle)).sum(),
        (bundle.weight_rotation * turned**2).sum(),
        (bundle.weight_bias * state.bias**2).sum(),
        (((state.roll - bundle.expected_roll) / bundle.sigma_roll) ** 2).sum(),
        _rough(state, bundle),
        (((state.lens - nominal_lens(bundle.cameras)) / sigma_lens(bundle)) ** 2).sum(),
    )
    return float(sum(terms))


def _rough(state: State, bundle: Bundle) -> float:
    """What heights cost. Those of rough surfaces more, but relative to the cameras' distance: how large the
    whole is and how far away, with a focal length to match, they do not tell."""
    if bundle.spread == ON_SURFACE:
        return float(height_weight(state, bundle) * (state.w**2).sum())
    independent = bundle.spread.determined / ALIKE
    relative = np.sqrt(height_squares(state, bundle)) / state.C[:, 2].sum()
    return float(2.0 * independent * np.log(relative))
