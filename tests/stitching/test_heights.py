"""Surfaces that are not flat and that nobody scanned: what the photos themselves tell of their heights."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artifacts import store
from artifacts.relief_picture import _drawn
from artifacts.uncertainty_map import _height_sigma_m, _sigmas_mm
from tasks.stitching import adjustment
from tasks.stitching.adjustment import Adjusted, adjust
from tasks.stitching.bundle import ON_SURFACE, Bundle, Spread, State, build_bundle, nominal_lens
from tasks.stitching.control import Gauge
from tasks.stitching.heights import Heights
from tasks.stitching.kriging import _spacing, relief_of
from tasks.stitching.mosaicking import _gauged
from tasks.stitching.normal_equations import _add_priors
from tasks.stitching.prior import Prior
from tasks.stitching.relief import HeightMap
from tasks.stitching.solution import Solved
from tasks.stitching.task import pages
from tasks.stitching.tracks import Observations
from tasks.stitching.uncertainty import noise
from tasks.stitching.view import FACING, View
from tests.benchmarks.mosaic_truth import errors
from tests.benchmarks.stitching import Run, run
from tests.benchmarks.wall_photos import CASES, wall_photos
from tests.stitching.test_adjustment import CAMERA, CORNERS, PIXEL_M, flown, observed, off_m
from tests.stitching.test_on_relief import waves

Array = npt.NDArray[np.float64]


def found(true: list[View], surface_known: bool = False) -> Adjusted:
    said, seen, priors = observed(true, 0.3, 20)
    return adjust(said, seen, priors, np.full(3, 0.05), [0.01] * 12, lambda _: None, surface_known)


def rms_px(adjusted: Adjusted, true: list[View]) -> float:
    return float(np.sqrt((off_m(adjusted, true, CORNERS) ** 2).sum(axis=2).mean())) / PIXEL_M


def scale(adjusted: Adjusted, true: list[View]) -> float:
    """Of the whole, against the truth."""
    spread = [np.std([v.C[:2] for v in views], axis=0).sum() for views in (adjusted.views, true)]
    return float(spread[0] / spread[1])


@pytest.fixture(scope="module")
def rough() -> list[View]:
    return [replace(view, relief=waves(3)) for view in flown(20, 0.0)]


@pytest.fixture(scope="module")
def freed(rough: list[View]) -> Adjusted:
    return found(rough)


def test_photos_tell_the_heights_of_what_they_show(rough: list[View], freed: Adjusted) -> None:
    """6 mm RMS; laid on the plane the photos lie off twice as much, thrice where several show a place."""
    assert freed.heights is not None
    real = waves(3).at(freed.heights.at)
    off = freed.heights.w - real - np.median(freed.heights.w - real)
    assert np.corrcoef(freed.heights.w, real)[0, 1] > 0.9
    assert 0.8 < np.median(np.abs(off) / freed.heights.sigma) / 0.6745 < 2.0
    assert freed.heights.usual == pytest.approx(0.006, rel=0.25)
    held = found(rough, surface_known=True)
    assert held.heights is None
    relief, _ = relief_of(freed.heights)
    laid = replace(freed, views=tuple(replace(view, relief=relief) for view in freed.views))
    assert rms_px(laid, rough) < 0.5 * rms_px(held, rough)


def test_heights_draw_neither_the_scale_nor_the_focal_length_in(rough: list[View], freed: Adjusted) -> None:
    """A surface is flatter the smaller everything is: by 15 %, where that counts for it."""
    assert scale(freed, rough) == pytest.approx(1.0, abs=0.02)
    assert freed.views[0].camera.focal_px == pytest.approx(2000.0, rel=0.01)


def test_heights_do_not_tell_how_large_the_whole_is(rough: list[View]) -> None:
    """Positions known to five metres do not either: it could be half or twice as large."""
    said, seen, priors = observed(rough, 0.3, 20)
    loose = [replace(prior, sigma_position=np.full(3, 5.0)) for prior in priors]
    adjusted = adjust(said, seen, loose, np.full(3, 5.0), [0.01] * 12, lambda _: None)
    assert adjusted.heights is not None
    assert adjusted.certainty.scale > 0.3


@pytest.mark.parametrize("seed", [20, 21])
def test_flat_walls_have_no_heights(seed: int) -> None:
    true = flown(seed, 1.0)
    said, seen, priors = observed(true, 0.3, seed)
    assert adjust(said, seen, priors, np.full(3, 0.05), [0.01] * 12, lambda _: None).heights is None


@pytest.mark.parametrize("seed", [20, 21, 22])
def test_noise_taken_for_heights_is_seen_to_be_noise(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Left free, they would bend the wall by five pixels."""
    monkeypatch.setattr(adjustment, "told_spread", lambda *_: (Spread(0.0005, 1000.0), 0.4))
    true = flown(seed, 0.0)
    said, seen, priors = observed(true, 0.3, seed)
    adjusted = adjust(said, seen, priors, np.full(3, 0.05), [0.01] * 12, lambda _: None)
    assert adjusted.heights is None
    assert rms_px(adjusted, true) < 0.3


def freed_bundle(heights_m: float) -> tuple[State, Bundle]:
    """Two photos, 40 points that stand off the plane."""
    rng = np.random.default_rng(0)
    views = flown(20, 0.0)[:2]
    uv = rng.uniform((0.0, -0.5), (1.0, 0.5), (40, 2))
    xy = np.concatenate([view.to_photo(uv) for view in views])
    photo, track = np.repeat([0, 1], 40), np.tile(np.arange(40), 2)
    order = np.argsort(track, kind="stable")
    seen = Observations(photo[order], track[order], xy[order])
    priors = [Prior(v, np.full(3, 0.1), np.full(3, 0.05)) for v in views]
    known = (priors, np.full(3, 0.1), [0.01, 0.01], np.full(2, 5.0), np.zeros((2, 2)))
    bundle = replace(build_bundle(views, (CAMERA,), seen, *known), spread=Spread(heights_m, 30.0))
    state = State(
        R=np.stack([v.R for v in views]),
        C=np.stack([v.C for v in views]),
        roll=np.zeros((2, 2)),
        lens=nominal_lens((CAMERA,)),
        bias=np.zeros(3),
        X=uv,
        w=rng.normal(0.0, heights_m, 40),
    )
    return state, bundle


def test_heights_count_relative_to_the_cameras_distance() -> None:
    """Everything half as large and half as far away is as rough: what it costs, and its slope, agree."""
    state, bundle = freed_bundle(0.02)
    cost = adjustment._rough(state, bundle)
    halved = replace(bundle, spread=bundle.spread._replace(sigma=0.01))
    smaller = replace(state, C=0.5 * state.C, w=0.5 * state.w)
    assert adjustment._rough(smaller, halved) == pytest.approx(cost)
    step = 1e-6 * np.array([[0, 0, 1.0], [0, 0, 0]])
    farther = replace(state, C=state.C + step)
    slope = (adjustment._rough(farther, bundle) - cost) / 1e-6
    pulls = []
    for of in (bundle, replace(bundle, spread=ON_SURFACE)):
        A, g = np.zeros((23, 23)), np.zeros(23)
        _add_priors(A, g, state, of, np.ones(2))
        pulls.append(g[5])
    assert pulls[0] - pulls[1] == pytest.approx(slope / 2, rel=1e-4)


def test_points_that_are_free_to_rise_follow_more_of_the_noise() -> None:
    """Of 160 residuals 80 are left by 40 points on a surface, 50 where 30 of their heights are told."""
    _, bundle = freed_bundle(0.02)
    residual, share = np.random.default_rng(1).normal(0, 0.3, (80, 2)), np.ones(80)
    held = noise(replace(bundle, spread=ON_SURFACE), residual, share)
    assert noise(bundle, residual, share) == pytest.approx(held * 80 / 50)


def told(noise_m: float, reach_m: tuple[float, float] = (5.0, 4.0)) -> Heights:
    """3,000 points over the waves, as well as photos tell them."""
    rng = np.random.default_rng(1)
    at = rng.uniform((-2.0, -1.5), reach_m, (3000, 2))
    return Heights(at, waves(3).at(at) + rng.normal(0, noise_m, len(at)), np.full(len(at), noise_m), 0.006)


def over(low: tuple[float, float], high: tuple[float, float]) -> Array:
    return np.random.default_rng(2).uniform(low, high, (2000, 2))


def test_points_along_a_diagonal_lie_as_close_as_along_a_row() -> None:
    row = np.random.default_rng(1).uniform((0.0, 0.0), (20.0, 1.0), (2000, 2))
    turned = row @ np.array([[1.0, 1.0], [-1.0, 1.0]]) / np.sqrt(2.0)
    spacings = [_spacing(at - at.min(axis=0), np.ptp(at, axis=0)) for at in (row, turned)]
    assert spacings == pytest.approx([0.1, 0.1], rel=0.2)


def test_a_relief_knows_where_photos_look() -> None:
    relief = HeightMap(np.zeros((5, 9)), -1.0, 2.0, 0.5)
    square = np.array([[0.0, 2.0], [1.0, 2.0], [1.0, 3.0], [0.0, 3.0]])
    seen = relief.seen_by([square, square + np.array([10.0, 0.0])])
    assert np.argwhere(seen).min(axis=0).tolist() == [0, 2]
    assert np.argwhere(seen).max(axis=0).tolist() == [2, 4]
    assert seen.sum() == 9


def test_a_large_relief_is_drawn_small() -> None:
    picture, _, _ = _drawn(np.zeros((20, 4000), np.float32))
    assert picture.shape == (4, 900, 3)


def test_the_relief_is_surer_than_each_of_its_points() -> None:
    relief, sigma = relief_of(told(0.003))
    places = over((-1.9, -1.4), (4.9, 3.9))
    off = relief.at(places) - waves(3).at(places)
    assert off.std() < 0.002
    assert np.std(off / sigma.at(places)) == pytest.approx(1.0, abs=0.25)


def test_where_there_are_no_points_nothing_is_known() -> None:
    heights = told(0.001)
    inside = np.linalg.norm(heights.at - [1.5, 1.0], axis=1) > 1.0
    relief, sigma = relief_of(Heights(heights.at[inside], heights.w[inside], heights.sigma[inside], 0.006))
    middle = np.array([[1.5, 1.0]])
    assert sigma.at(middle)[0] == pytest.approx(0.006, rel=0.05)
    assert abs(relief.at(middle)[0]) < 0.003
    assert np.median(sigma.w) < 0.002


def test_points_that_lie_on_one_another_and_in_a_row_are_borne() -> None:
    at = np.column_stack([np.repeat(np.linspace(0.0, 3.0, 40), 3), np.zeros(120)])
    heights = Heights(at, 0.01 * np.sin(4 * at[:, 0]), np.full(120, 1e-3), 0.007)
    relief, _ = relief_of(heights)
    np.testing.assert_allclose(relief.at(at), heights.w, atol=1e-3)


@given(st.floats(0.1, 10.0), st.floats(-3.2, 3.2), st.tuples(st.floats(-50, 50), st.floats(-50, 50)))
def test_a_relief_moves_with_the_plane(factor: float, angle: float, shift: tuple[float, float]) -> None:
    still = waves(3)
    moved = still.moved(factor, angle, np.array(shift))
    places = over((-2.0, -1.5), (5.0, 4.0))
    c, s = np.cos(angle), np.sin(angle)
    where = factor * places @ np.array([[c, s], [-s, c]]) + shift
    off = moved.at(where) / factor - still.at(places)
    assert np.abs(off).max() < 0.003
    assert off.std() < 0.0005
    assert isinstance(moved, HeightMap)


@pytest.fixture(scope="module")
def unscanned(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    """3 cm from the lowest to the highest point, 12 photos of 2 MP."""
    (case,) = (c for c in CASES if c.name == "relief")
    with store.temporary():
        yield run(wall_photos(case, 4, 3, 2.0, 1, tmp_path_factory.mktemp("relief")))


def test_the_mosaic_lies_on_the_photos_own_relief(unscanned: Run) -> None:
    mosaic = unscanned.mosaic
    assert mosaic.relief is not None
    assert mosaic.relief.measured_by == "photos"
    assert "on the photos' relief" in mosaic.gauge
    assert 0.1 < 1000 * mosaic.relief.sigma_m < 1.0
    assert errors(mosaic, unscanned.photos, unscanned.heights).rms_px < 0.7
    assert np.percentile(unscanned.steps_px, 95) < 0.7
    flat = mosaic.model_copy(update={"relief": None})
    assert errors(flat, unscanned.photos, None).rms_px > 1.0


def test_the_map_of_uncertainty_knows_where_the_relief_is_not_known(unscanned: Run) -> None:
    """Beyond the outermost points of the photos' relief: more than the same heights all over would say."""
    mosaic, shelf = unscanned.mosaic, store.current()
    assert mosaic.relief is not None
    sigmas, _ = _sigmas_mm(mosaic, shelf.path, (80, 60))
    everywhere = mosaic.model_copy(update={"relief": mosaic.relief.model_copy(update={"sigmas": None})})
    alike, _ = _sigmas_mm(everywhere, shelf.path, (80, 60))
    assert np.nanmax(sigmas) > 1.5 * np.nanmax(alike)
    assert np.nanmin(sigmas) == pytest.approx(np.nanmin(alike), rel=0.1)
    told = np.load(shelf.path(mosaic.relief.sigmas)) if mosaic.relief.sigmas else np.zeros((0, 0))
    row, column = 3, 5
    u, v = (
        mosaic.relief.left_m + column * mosaic.relief.cell_m,
        mosaic.relief.bottom_m + row * mosaic.relief.cell_m,
    )
    found = _height_sigma_m(mosaic, shelf.path, np.array([[u]]), np.array([[v]]))
    assert found[0, 0] == told[row, column] != told[column, row]


def test_the_dashboard_shows_the_photos_own_relief(unscanned: Run) -> None:
    (page,) = (page for page in pages({}, unscanned.mosaic) if page.key.startswith("relief-by-photos"))
    assert "measured by photos" in (page.markdown or "")


def test_control_moves_the_photos_own_relief_and_leaves_that_of_a_scan_where_it_is() -> None:
    sigma = HeightMap(np.full((3, 3), 0.001), 0.0, 0.0, 1.0)
    gauge = Gauge(2.0, 0.0, np.array([1.0, 0.0]), "targets")
    views = {0: View(CAMERA, FACING, np.array([0.0, 0.0, 4.0]), relief=waves(3))}
    own = Solved(views, {0: 9}, {0: 0.3}, {0: np.eye(2)}, 0.0, 0.3, (), frozenset(), waves(3), sigma)
    moved = _gauged(own, gauge)
    assert moved.relief is not None and moved.relief_sigma is not None
    assert moved.views[0].relief is moved.relief
    places = over((-2.0, -1.5), (5.0, 4.0))
    np.testing.assert_allclose(moved.relief.at(2 * places + [1.0, 0.0]), 2 * waves(3).at(places), atol=1e-9)
    assert moved.relief_sigma.w.max() == pytest.approx(0.002)
    scanned = _gauged(replace(own, relief_sigma=None), gauge)
    assert scanned.relief is own.relief
