"""The relief that photos tell: what is known of it says where else to look for what they show alike."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from tasks.stitching.adjustment import Adjusted
from tasks.stitching.heights import Heights
from tasks.stitching.kriging import relief_of
from tasks.stitching.matching import match_guided
from tasks.stitching.pairs import Edge, PhotoFeatures, spread
from tasks.stitching.rays import Apart, as_taken, rays_of
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import Observations, build_tracks
from tasks.stitching.verification import tolerance_px
from tasks.stitching.view import Array, View

ROUNDS = 5
ROUGHER = 1.05  # than thought before: worth another round
REACH = 3.0  # sigma of the relief to look above and below it
PLACES = 6  # at most, to each side of the likeliest, that a point is looked for at
OUTLIER = 4.0  # sigma: rays that miss one another by more show different points

Adjust = Callable[[Sequence[View], Observations], Adjusted | None]  # None: some photo comes loose


class OnOwnRelief(NamedTuple):
    adjusted: Adjusted
    relief: HeightMap
    sigma: HeightMap  # 1σ of its heights


def on_own_relief(
    adjusted: Adjusted,
    guesses: Sequence[View],
    edges: Sequence[Edge],
    features: Sequence[PhotoFeatures],
    ransac_px: float,
    adjust: Adjust,
) -> OnOwnRelief:
    """Matched along the rays and adjusted anew, as long as that shows the surface to be rougher.

    adjusted: with heights, of the matches of `edges`, which some plane carries; guesses: the views that it
    was adjusted from, under whose cameras features are undistorted. ransac_px: how far from where it is
    expected a point may be."""
    assert adjusted.heights is not None
    cameras = [view.camera for view in guesses]
    seen = [
        replace(f, xy=as_taken(f.xy.astype(float), camera).astype(np.float32))
        for f, camera in zip(features, cameras, strict=True)
    ]
    within_px = [tolerance_px(camera, ransac_px) for camera in cameras]
    held, heights = _matches(edges), adjusted.heights
    for _ in range(ROUNDS):
        usual, (relief, sigma) = heights.usual, relief_of(heights)
        every = _rematched(adjusted.views, relief, sigma, edges, seen, within_px)
        if _matches(every) < held:
            break
        heights = _heights(adjusted, every, seen)
        if np.sqrt(np.mean(heights.w**2)) < ROUGHER * usual:
            break
        some = [replace(edge, matches=spread(edge.matches, seen[edge.a].xy)) for edge in every]
        views = [
            replace(view, camera=camera, roll_px=np.zeros(2))
            for view, camera in zip(adjusted.views, cameras, strict=True)
        ]
        again = adjust(views, build_tracks(some, features))
        if again is None or again.heights is None:
            break
        if len(np.setdiff1d(adjusted.observations.photo, again.observations.photo)):
            break
        adjusted, heights = again, _heights(again, every, seen)
    return OnOwnRelief(adjusted, *relief_of(heights))


def _matches(edges: Sequence[Edge]) -> int:
    return sum(len(edge.matches) for edge in edges)


def _rematched(
    views: Sequence[View],
    relief: HeightMap,
    sigma: HeightMap,
    edges: Sequence[Edge],
    seen: Sequence[PhotoFeatures],
    within_px: Sequence[float],
) -> list[Edge]:
    """Every pair anew, all its features: each is looked for along its ray, as far as the relief is unsure."""
    views = [replace(view, relief=relief) for view in views]
    rays = {a: rays_of(views[a], seen[a].xy.astype(float)) for a in sorted({edge.a for edge in edges})}
    found = []
    for edge in edges:
        (at, lean), other, within = rays[edge.a], views[edge.b], within_px[edge.b]
        reach = REACH * sigma.at(at)

        def shown(above: Array, at: Array = at, lean: Array = lean, other: View = other) -> Array:
            """(N, 2) pixels of the other photo where it shows each ray so high above the relief."""
            there = at + above[:, None] * lean
            return other.to_photo(there, relief.at(at) + above - relief.at(there))

        middle = shown(np.zeros(len(at)))
        size = np.array([other.camera.width_px, other.camera.height_px])
        inside = ((middle > 0) & (middle < size)).all(axis=1)
        length = np.linalg.norm(shown(reach) - middle, axis=1)[inside].max(initial=0.0)
        places = min(PLACES, max(0, int(np.ceil((length - within) / (1.5 * within)))))
        above = np.linspace(-1.0, 1.0, 2 * places + 1) if places else np.zeros(1)
        predicted = np.stack([shown(share * reach) for share in above], axis=1)
        a, b = seen[edge.a], seen[edge.b]
        matches = match_guided(a.descriptors, b.descriptors, predicted, b.xy, within)
        found.append(replace(edge, matches=matches))
    return found


def _heights(adjusted: Adjusted, edges: Sequence[Edge], seen: Sequence[PhotoFeatures]) -> Heights:
    """Of all points that are matched, cameras as they are."""
    assert adjusted.heights is not None
    usual = adjusted.heights.usual
    observations = build_tracks(edges, seen)
    photo, track = observations.photo, observations.track
    p, lean = np.zeros((len(photo), 2)), np.zeros((len(photo), 2))
    for i in np.unique(photo):
        p[photo == i], lean[photo == i] = rays_of(adjusted.views[i], observations.xy[photo == i])
    apart = Apart.of(p, lean, track, np.ones(len(track)))
    w = apart.agreed / apart.power
    at = apart.at + w[:, None] * apart.lean
    missed = np.bincount(track, ((p + w[track, None] * lean - at[track]) ** 2).sum(axis=1))
    free = 2 * np.bincount(track) - 3
    noise = float(np.median(missed / chi2.median(free)))  # plane units²
    sigma = np.sqrt(noise / apart.power)
    good = (missed < OUTLIER**2 * free * noise) & (np.abs(w) < OUTLIER * np.hypot(sigma, usual))
    good &= sigma < usual  # seen from nearly one place, a point could stand anywhere along its rays
    return Heights(at[good], w[good], sigma[good], usual)
