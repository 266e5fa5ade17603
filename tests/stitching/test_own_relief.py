"""Surfaces too rough for any plane to carry their matches: what lies near one leads to the rest."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from tasks.stitching import own_relief
from tasks.stitching.adjustment import Adjusted, adjust
from tasks.stitching.kriging import relief_of
from tasks.stitching.own_relief import OnOwnRelief, on_own_relief
from tasks.stitching.pairs import Edge, PhotoFeatures
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import Observations, build_tracks
from tasks.stitching.view import View
from tests.stitching.test_adjustment import CAMERA, flown, observed
from tests.stitching.test_heights import told
from tests.stitching.test_on_relief import waves

Array = npt.NDArray[np.float64]
POINTS = 6000
PLAIN = CAMERA.model_copy(update={"k1": 0.0})
NEAR_M = 0.01  # the plane: such points a homography carries


def rough(factor: float = 3.0) -> HeightMap:
    """Some 8 cm from the lowest to the highest point, seen from 4 m."""
    return replace(waves(3), w=factor * waves(3).w)


def shown(true: list[View]) -> tuple[list[PhotoFeatures], list[Edge]]:
    """What photos show of points that all look different, and the matches of those near the plane."""
    rng = np.random.default_rng(5)
    uv = rng.uniform((-1.5, -1.2), (5.5, 3.3), (POINTS, 2))
    looks = rng.exponential(size=(POINTS, 128))
    descriptors = np.rint(512 * np.sqrt(looks / looks.sum(axis=1, keepdims=True))).astype(np.uint8)
    assert true[0].relief is not None
    low = np.abs(true[0].relief.at(uv)) < NEAR_M
    features, which = [], []
    for view in true:
        taken = view.to_photo(uv) + rng.normal(0, 0.3, uv.shape)
        seen = np.flatnonzero(((taken > 0) & (taken < [1599, 1199])).all(axis=1))
        ideal = (taken[seen] - CAMERA.principal_px) / CAMERA.focal_px
        xy = PLAIN.undistort(ideal) * CAMERA.focal_px + CAMERA.principal_px
        none = np.zeros(len(seen), np.float32)
        features.append(PhotoFeatures(xy.astype(np.float32), none, none, descriptors[seen]))
        which.append(seen)
    edges = []
    for a, b in combinations(range(len(true)), 2):
        both = np.intersect1d(which[a], which[b])
        both = both[low[both]][:120]
        if len(both) > 30:
            places = np.searchsorted(which[a], both), np.searchsorted(which[b], both)
            edges.append(Edge(a, b, np.column_stack(places)))
    return features, edges


class Found(NamedTuple):
    first: Adjusted
    own: OnOwnRelief


Adjusting = Callable[[Sequence[View], Observations], Adjusted | None]


def followed(factor: float, again: Callable[[Adjusting], Adjusting] = lambda as_is: as_is) -> Found:
    """Adjusted to the matches of what lies near the plane, and on the relief that these lead to; `again`
    makes of the adjustment what is adjusted anew with."""
    true = [replace(view, relief=rough(factor)) for view in flown(20, 0.0)]
    said, _, priors = observed(true, 0.3, 20)
    features, edges = shown(true)

    def freed(views: Sequence[View], seen: Observations) -> Adjusted:
        return adjust(views, seen, priors, np.full(3, 0.05), [0.01] * 12, lambda _: None)

    first = freed(said, build_tracks(edges, features))
    return Found(first, on_own_relief(first, said, edges, features, 3.0, again(freed)))


def test_what_lies_near_a_plane_leads_to_the_rest() -> None:
    """Of points that no plane carried the relief is known as well as of the others."""
    first, own = followed(3.0)
    assert first.heights is not None
    assert own.adjusted.heights is not None
    assert first.heights.usual < 0.5 * rough().w.std()
    assert own.adjusted.heights.usual == pytest.approx(rough().w.std(), rel=0.15)
    places = np.random.default_rng(6).uniform((-0.8, -0.6), (4.8, 2.8), (3000, 2))
    real = rough().at(places + _shift(own.adjusted))
    off = own.relief.at(places) - real
    high = np.abs(real) > 2 * NEAR_M
    assert high.mean() > 0.2
    assert np.corrcoef(own.relief.at(places), real)[0, 1] > 0.92
    assert np.median(np.abs(off[high])) < 0.006
    assert np.median(own.sigma.at(places)) < 0.003


def test_points_are_looked_for_as_far_along_their_rays_as_the_relief_is_unsure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where it is likeliest alone, two rounds find 24 of 42 mm."""
    monkeypatch.setattr(own_relief, "ROUNDS", 2)
    _, own = followed(7.0)
    assert own.adjusted.heights is not None
    assert own.adjusted.heights.usual > 0.028


def without_the_last(adjusting: Adjusting) -> Adjusting:
    def adjusted(views: Sequence[View], seen: Observations) -> Adjusted | None:
        return adjusting(views, seen.where(seen.photo < len(views) - 1))

    return adjusted


@pytest.mark.parametrize("again", [lambda _: lambda *_: None, without_the_last], ids=["loose", "lost"])
def test_no_relief_costs_a_photo(again: Callable[[Adjusting], Adjusting]) -> None:
    """The cameras stay as they were; the relief is that of all points that they show."""
    first, own = followed(3.0, again)
    assert own.adjusted is first
    assert np.median(own.sigma.w) < 0.01


def test_points_seen_from_nearly_one_place_tell_no_height() -> None:
    """Two photos 3 mm apart, as a vehicle that hovers takes them: a point may be half a metre off."""
    first, _ = followed(3.0, lambda _: lambda *_: None)
    assert first.heights is not None
    hovering = [first.views[0], replace(first.views[0], C=first.views[0].C + np.array([0.003, 0.0, 0.0]))]
    views = [*hovering, first.views[1]]
    features, edges = shown([replace(view, camera=CAMERA, relief=rough()) for view in views])
    twice = replace(first, views=tuple(replace(view, camera=CAMERA) for view in views))
    heights = own_relief._heights(twice, edges, features)
    assert len(heights.w) > 30
    assert heights.sigma.max() < first.heights.usual


def _shift(adjusted: Adjusted) -> Array:
    """(2,) from where the positions placed it all to where it is."""
    return np.mean([t.C[:2] - v.C[:2] for t, v in zip(flown(20, 0.0), adjusted.views, strict=True)], axis=0)


def test_false_points_leave_no_mark() -> None:
    """A match that is wrong by decimetres is no peak of the surface."""
    heights = told(0.0005)
    false = np.arange(0, len(heights.w), 100)
    wrong = heights.w.copy()
    wrong[false] += 0.05
    relief, _ = relief_of(replace(heights, w=wrong))
    off = relief.at(heights.at[false]) - waves(3).at(heights.at[false])
    assert np.abs(off).max() < 0.006
