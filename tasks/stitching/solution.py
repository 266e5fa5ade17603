"""The paper's registration, whole: match, verify, average, adjust; what the matches hold, metrically."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import NamedTuple

import numpy as np

from tasks.stitching.adjustment import Adjusted, adjust
from tasks.stitching.averaging import Guess, average
from tasks.stitching.candidates import candidate_pairs
from tasks.stitching.on_relief import on_relief
from tasks.stitching.own_relief import on_own_relief
from tasks.stitching.pairs import Edge, PhotoFeatures, match_pairs
from tasks.stitching.placement import elsewhere
from tasks.stitching.prior import PlaneFrame
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import Index, Observations, build_tracks
from tasks.stitching.view import Array, View

LEAST_OBSERVATIONS = 12  # a photo with fewer points left is not held by them
LEAST_KEPT = 0.4  # nor one most of whose points the adjustment threw out
LARGEST_SCALE = 5.0  # against the median photo: beyond, it has shrunk to nothing or flown away
LARGEST_MEDIAN_PX = 3.0  # per 2 MP photo; more is a photo in a wrong place, less may be trees on the ground
SPARING = 2  # first attempts, in which of neighbours only the loosest goes: without it the others may hold
FEWEST_TOLD = 4  # photos: of fewer a similarity takes up most of what they err by among themselves


@dataclass(frozen=True)
class Solved:
    views: dict[int, View]  # photos held by their matches
    matches: dict[int, int]  # points that hold each
    rms_px: dict[int, float]  # of their residuals, in pixels of the photo
    covariance: dict[int, Array]  # (2, 2), plane units², of where the photos' middles lie among one another
    sigma_scale: float  # of the whole, relative
    sigma_px: float
    edges: tuple[Edge, ...]  # that passed the pairwise test, and
    held: frozenset[tuple[int, int]]  # those among them that the whole graph agrees with
    relief: HeightMap | None = None  # that the views look at; None: the plane
    relief_sigma: HeightMap | None = None  # 1σ of its heights, where the photos themselves told it


def solve(
    features: Sequence[PhotoFeatures],
    frame: PlaneFrame,
    focal_sigmas: Sequence[float],
    pairs: Sequence[tuple[int, int]],
    ransac_px: float,
    on_progress: Callable[[float], None],
    relief: HeightMap | None = None,
) -> Solved:
    """Views of all photos that the matches hold together, on the relief where one is given and fits."""
    matched = match_pairs(pairs, features, frame.priors, ransac_px, lambda f: on_progress(0.6 * f))
    edges = matched

    def adjusted_from(views: Sequence[View], seen: Observations, surface_known: bool) -> Adjusted:
        return adjust(
            views,
            seen,
            frame.priors,
            frame.sigma_bias,
            focal_sigmas,
            lambda f: on_progress(0.6 + 0.4 * f),
            surface_known,
        )

    def laid(views: Sequence[View], seen: Observations) -> Adjusted:
        return adjusted_from(views, seen, True)

    def freed(views: Sequence[View], seen: Observations) -> Adjusted | None:
        found = adjusted_from(views, seen, False)
        return None if _loose(_kept(seen, found), found) else found

    for attempt in count():
        guess = average(edges, features, frame.priors, frame.sigma_bias)
        held = _anchored(guess, frame)
        edges = [e for e in guess.edges if e.a in held and e.b in held]
        observations = build_tracks(edges, features)
        if len(observations.photo) == 0:
            break

        adjusted = adjusted_from(guess.views, observations, relief is not None)
        kept = _kept(observations, adjusted)
        loose = _loose(kept, adjusted)
        if attempt < SPARING:
            loose = _loosest(loose, kept, edges)
        loose |= elsewhere(
            guess.component, set(map(int, np.unique(observations.photo))), adjusted.views, frame, features
        )
        if not loose:
            if relief is not None:
                sigma = float(frame.sigma_bias[:2].max())
                raised = on_relief(relief, adjusted, guess.views, observations, sigma, laid)
                if raised is adjusted or _loose(_kept(observations, raised), raised):
                    raised = freed(guess.views, observations) or adjusted
                adjusted = raised
            if adjusted.heights is None:
                return _solved(adjusted, matched, edges)
            own = on_own_relief(adjusted, guess.views, edges, features, ransac_px, freed)
            return _solved(own.adjusted, matched, edges, own.relief, own.sigma)
        edges = [e for e in edges if e.a not in loose and e.b not in loose]  # at least one goes each time
    return Solved({}, {}, {}, {}, 0.0, 0.0, tuple(matched), frozenset())


def neighbours(features: Sequence[PhotoFeatures], frame: PlaneFrame) -> list[tuple[int, int]]:
    return candidate_pairs(
        frame.priors, [f.scale.astype(np.float64) for f in features], [f.descriptors for f in features]
    )


def _anchored(guess: Guess, frame: PlaneFrame) -> set[int]:
    """Photos of every connected group that its priors place; without any position, the largest group."""
    count = int(guess.component.max(initial=-1)) + 1
    held: set[int] = set()
    nowhere = not any(prior.has_position for prior in frame.priors)
    for number in range(count):
        members = np.flatnonzero(guess.component == number)
        positioned = any(frame.priors[i].has_position for i in members)
        if len(members) >= 2 and (positioned or (number == 0 and nowhere)):
            held |= {int(i) for i in members}
    return held


class _Kept(NamedTuple):
    """Points of each photo, before the adjustment threw some out and after."""

    before: Index
    after: Index


def _kept(observations: Observations, adjusted: Adjusted) -> _Kept:
    photos = len(adjusted.views)
    before, after = (np.bincount(o.photo, minlength=photos) for o in (observations, adjusted.observations))
    return _Kept(before, after)


def _loose(kept: _Kept, adjusted: Adjusted) -> set[int]:
    """Photos that the adjustment could not hold: too few points, most thrown out, most residuals large (a
    few are wherever something stands out of the plane), or a scale that has run away."""
    before, after = kept
    lengths = np.linalg.norm(adjusted.residual_px, axis=1)
    usual = np.array([np.median(lengths[adjusted.observations.photo == i]) for i in np.flatnonzero(after)])
    size = np.array([v.camera.width_px * v.camera.height_px for v in adjusted.views])
    allowed = LARGEST_MEDIAN_PX * np.maximum(1.0, np.sqrt(size / 2.0e6))
    bad = after < np.maximum(LEAST_OBSERVATIONS, LEAST_KEPT * before)
    bad[after > 0] |= usual > allowed[after > 0]
    behind = np.array([v.C[2] <= 0 or not np.isfinite(v.outline_uv).all() for v in adjusted.views])
    scale = np.log([v.units_per_px for v in adjusted.views])
    odd = np.abs(scale - np.median(scale[before > 0])) > np.log(LARGEST_SCALE)
    return {int(i) for i in np.flatnonzero((bad | behind | odd) & (before > 0))}


def _loosest(loose: set[int], kept: _Kept, edges: Sequence[Edge]) -> set[int]:
    """Those of them with no neighbour among them of whose points less were kept."""
    share = kept.after / np.maximum(kept.before, 1)
    tied = [(e.a, e.b) for e in edges if e.a in loose and e.b in loose]
    return loose - {a if share[a] > share[b] else b for a, b in tied if share[a] != share[b]}


def _solved(
    adjusted: Adjusted,
    matched: Sequence[Edge],
    held: Sequence[Edge],
    own_relief: HeightMap | None = None,
    own_sigma: HeightMap | None = None,
) -> Solved:
    photo = adjusted.observations.photo
    points = np.bincount(photo, minlength=len(adjusted.views))
    squares = np.bincount(photo, (adjusted.residual_px**2).sum(axis=1), minlength=len(adjusted.views))
    seen = np.flatnonzero(points)
    told = dict(zip((int(i) for i in seen), adjusted.certainty.relative, strict=True))
    relief = own_relief or adjusted.views[seen[0]].relief
    return Solved(
        views={int(i): replace(adjusted.views[i], relief=relief) for i in seen},
        matches={int(i): int(points[i]) for i in seen},
        rms_px={int(i): float(np.sqrt(squares[i] / points[i])) for i in seen},
        covariance=told if len(seen) >= FEWEST_TOLD else {},
        sigma_scale=adjusted.certainty.scale,
        sigma_px=adjusted.sigma_px,
        edges=tuple(matched),
        held=frozenset((edge.a, edge.b) for edge in held),
        relief=relief,
        relief_sigma=own_sigma,
    )
