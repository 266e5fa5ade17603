"""Matches, the paper's rule, and the graph of pairs."""

import numpy as np
import pytest

from schemas.camera import Camera
from tasks.stitching import pairs
from tasks.stitching.averaging import average
from tasks.stitching.matching import match, match_guided
from tasks.stitching.pairs import Edge, PhotoFeatures
from tasks.stitching.prior import Prior
from tasks.stitching.tracks import build_tracks
from tasks.stitching.verification import Verified, plausible, verify
from tasks.stitching.view import FACING, View

CAMERA = Camera(width_px=800, height_px=600, focal_px=1000.0)


def descriptors(count: int, seed: int) -> np.ndarray:
    """(N, 128) of RootSIFT's length, random and so unlike each other."""
    raw = np.random.default_rng(seed).gamma(0.4, size=(count, 128))
    share = raw / raw.sum(axis=1, keepdims=True)
    return np.minimum(np.rint(np.sqrt(share) * 512), 255).astype(np.uint8)


def test_what_is_alike_is_matched_and_nothing_else() -> None:
    common, only_a, only_b = descriptors(200, 1), descriptors(100, 2), descriptors(150, 3)
    order = np.random.default_rng(4).permutation(350)
    b = np.concatenate([common, only_b])[order]
    found = match(np.concatenate([common, only_a]), b)
    assert set(found[:, 0]) == set(range(200))
    assert (order[found[:, 1]] == found[:, 0]).all()


def test_repeated_texture_is_left_to_guided_matching() -> None:
    """Each of 50 things is seen twice in b: the ratio test refuses all; the place tells which it is."""
    things = descriptors(50, 1)
    xy = np.random.default_rng(2).uniform(0, 600, (50, 2)).astype(np.float32)
    b, xy_b = np.concatenate([things, things]), np.concatenate([xy, xy + 40])
    assert len(match(things, b)) == 0
    found = match_guided(things, b, xy.astype(np.float64) + 1.5, xy_b, 5.0)
    assert (found[:, 0] == found[:, 1]).all()
    assert len(found) == 50


@pytest.mark.parametrize(
    ("inliers", "overlapping", "holds"), [(8, 0, False), (9, 0, True), (38, 100, False), (39, 100, True)]
)
def test_the_papers_rule(inliers: int, overlapping: int, holds: bool) -> None:
    """n_i > 8 + 0.3 n_f."""
    assert Verified(np.eye(3), np.zeros((inliers, 2), np.int64), overlapping).holds == holds


def test_ransac_finds_the_homography_among_false_matches() -> None:
    rng = np.random.default_rng(0)
    H = np.array([[0.98, 0.05, -300.0], [-0.04, 1.01, 20.0], [1e-5, -2e-5, 1.0]])
    a = rng.uniform([320, 0], [800, 600], (300, 2))
    q = np.column_stack([a, np.ones(300)]) @ H.T
    b = q[:, :2] / q[:, 2:] + rng.normal(0, 0.3, (300, 2))
    b[150:] = rng.uniform(0, 600, (150, 2))
    both = np.column_stack([np.arange(300)] * 2)
    found = verify(a.astype(np.float32), b.astype(np.float32), both, CAMERA, 3.0)
    assert found is not None
    assert found.holds
    assert (found.inliers[:, 0] < 150).mean() > 0.97
    np.testing.assert_allclose(found.H / found.H[2, 2], H, rtol=0.02, atol=0.5)


def test_no_camera_sees_a_mirrored_plane() -> None:
    assert plausible(np.eye(3), CAMERA)
    assert not plausible(np.diag([-1.0, 1.0, 1.0]), CAMERA)
    assert not plausible(np.array([[1, 0, 0], [0, 1, 0], [-0.002, 0, 1.0]]), CAMERA)  # horizon in the photo
    assert not plausible(np.diag([0.1, 0.1, 1.0]), CAMERA)
    assert not plausible(np.zeros((3, 3)), CAMERA)


def ring(count: int) -> tuple[list[View], list[PhotoFeatures], list[Edge]]:
    """Photos on a circle that each share 30 points of the plane with the next two."""
    rng = np.random.default_rng(1)
    views, edges = [], []
    xy: list[list[np.ndarray]] = [[] for _ in range(count)]
    for k in range(count):
        t = 2 * np.pi * k / count
        at = np.array([3 * np.cos(t), 3 * np.sin(t), 4.0])
        views.append(View(CAMERA, FACING, at).moved(1.0, 0.0, np.zeros(2)))
    for i in range(count):
        for step in (1, 2):
            j = (i + step) % count
            middle = (views[i].centre_uv + views[j].centre_uv) / 2
            uv = middle + rng.uniform(-0.6, 0.6, (30, 2))
            start = sum(map(len, xy[i])), sum(map(len, xy[j]))
            xy[i].append(views[i].to_undistorted(uv))
            xy[j].append(views[j].to_undistorted(uv))
            matches = np.column_stack([np.arange(30) + start[0], np.arange(30) + start[1]])
            edges.append(Edge(i, j, matches))
    nothing = np.zeros((0, 128), np.uint8)
    features = [
        PhotoFeatures(
            np.concatenate(p).astype(np.float32), np.zeros(0, np.float32), np.zeros(0, np.float32), nothing
        )
        for p in xy
    ]
    return views, features, edges


def unknown(view: View) -> Prior:
    facing = View(view.camera, FACING, np.array([0.0, 0.0, 1.0]))
    return Prior(facing, np.full(3, np.inf), np.array([0.1, 0.1, np.inf]))


def test_averaging_finds_the_ring_and_the_false_edge() -> None:
    """Twelve photos from no prior at all, one false edge across the ring: found, and nothing shrinks."""
    views, features, edges = ring(12)
    false = Edge(0, 6, np.column_stack([np.arange(25), np.arange(25)]))
    guess = average([*edges, false], features, [unknown(v) for v in views], np.zeros(3))
    assert [(e.a, e.b) for e in guess.edges] == [(e.a, e.b) for e in edges]
    found = np.array([v.centre_uv @ [1, 1j] for v in guess.views])
    true = np.array([v.centre_uv @ [1, 1j] for v in views])
    columns = np.column_stack([found, np.ones(12)])
    fitted = columns @ np.linalg.lstsq(columns, true, rcond=None)[0]
    assert np.abs(fitted - true).max() < 1e-4
    heights = np.array([v.C[2] for v in guess.views])
    assert heights.std() / heights.mean() < 1e-4


def test_groups_without_a_common_photo_are_told_apart() -> None:
    views, features, edges = ring(12)
    apart = [e for e in edges if {e.a, e.b} <= set(range(5)) or {e.a, e.b} <= set(range(5, 12))]
    guess = average(apart, features, [unknown(v) for v in views], np.zeros(3))
    assert guess.component.tolist() == [1] * 5 + [0] * 7


def test_a_track_that_claims_two_places_of_a_photo_is_dropped() -> None:
    xy = np.array([[10, 10], [300, 300], [500, 50]], np.float32)
    nothing = np.zeros(3, np.float32)
    features = [PhotoFeatures(xy, nothing, nothing, np.zeros((3, 128), np.uint8)) for _ in range(3)]
    edges = [
        Edge(0, 1, np.array([[0, 0], [2, 2]])),
        Edge(1, 2, np.array([[0, 0], [2, 2]])),
        Edge(0, 2, np.array([[1, 0], [2, 2]])),  # feature 0 and 1 of photo 0 become one track
    ]
    found = build_tracks(edges, features)
    assert found.tracks == 1
    assert found.photo.tolist() == [0, 1, 2]
    assert (found.xy == [500, 50]).all()


def test_of_a_point_with_two_directions_the_second_match_comes_last() -> None:
    """130 points, of which 40 are there twice: all 120 that are taken are of different points."""
    rng = np.random.default_rng(5)
    xy = rng.uniform(0, 1000, (130, 2)).astype(np.float32)
    twice = np.concatenate([xy, xy[:40]])
    order = rng.permutation(len(twice))
    matches = np.column_stack([order, order]).astype(np.int64)
    taken = pairs.spread(matches, twice)
    assert len(taken) == pairs.ENOUGH
    assert len(np.unique(twice[taken[:, 0]], axis=0)) == pairs.ENOUGH
