"""Photos laid on a relief: where it lies, what it makes better, and when it is left alone."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.ndimage import gaussian_filter

from tasks.stitching.adjustment import Adjusted, adjust
from tasks.stitching.on_relief import best_shift, on_relief, seen_heights
from tasks.stitching.relief import HeightMap
from tasks.stitching.tracks import Observations
from tasks.stitching.view import View
from tests.stitching.test_adjustment import CAMERA, CORNERS, PIXEL_M, flown, observed, off_m

Array = npt.NDArray[np.float64]


def waves(seed: int) -> HeightMap:
    """Some 3 cm from the lowest to the highest point, waves of a few decimetres, 8 × 6.5 m."""
    rough = gaussian_filter(np.random.default_rng(seed).normal(size=(131, 161)), 3.0)
    return HeightMap(0.006 * rough / rough.std(), -2.5, -2.0, 0.05)


@pytest.fixture(scope="module")
def true() -> list[View]:
    return [replace(view, relief=waves(3)) for view in flown(20, 0.0)]


def laid(true: list[View], relief: HeightMap) -> tuple[Adjusted, Adjusted]:
    """Adjusted on the plane, and on the relief."""
    said, seen, priors = observed(true, 0.3, 20)

    def adjusted(views: Sequence[View], seen: Observations) -> Adjusted:
        return adjust(views, seen, priors, np.full(3, 0.05), [0.01] * 12, lambda _: None, surface_known=True)

    flat = adjusted(said, seen)
    return flat, on_relief(relief, flat, said, seen, 0.05, adjusted)


def rms_px(found: Adjusted, true: list[View]) -> float:
    return float(np.sqrt((off_m(found, true, CORNERS) ** 2).sum(axis=2).mean())) / PIXEL_M


def test_the_relief_of_a_scan_makes_a_bent_mosaic_true(true: list[View]) -> None:
    noisy = waves(3)
    noise = np.random.default_rng(1).normal(0, 0.001, noisy.w.shape)
    flat, raised = laid(true, replace(noisy, w=noisy.w + noise))
    assert rms_px(flat, true) > 1.2
    assert rms_px(raised, true) < 0.4


def test_another_walls_relief_is_left_alone(true: list[View]) -> None:
    flat, found = laid(true, waves(4))
    assert found is flat


def test_the_heights_that_photos_see_tell_where_the_relief_lies(true: list[View]) -> None:
    """Half a metre off, found to a cell."""
    flat, _ = laid(true, waves(3))
    at, heights, weight = seen_heights(flat, [CAMERA.model_copy(update={"k1": 0.0})] * len(true))
    assert np.corrcoef(heights, waves(3).at(at))[0, 1] > 0.5
    off = np.array([0.45, -0.3])
    found = best_shift(waves(3), at + off, heights, weight, reach=0.8, slow=0.8)
    np.testing.assert_allclose(found, -off, atol=0.1)


def test_heights_of_noise_tell_no_place() -> None:
    rng = np.random.default_rng(0)
    at = rng.uniform((-2.0, -1.5), (5.0, 4.0), (1000, 2))
    assert (best_shift(waves(3), at, rng.normal(0, 0.01, 1000), np.ones(1000), 1.0, 0.8) == 0).all()


def test_slopes_are_those_of_the_heights() -> None:
    relief = waves(5)
    uv = np.random.default_rng(2).uniform((-2.4, -1.9), (5.0, 4.0), (200, 2))
    for axis, along in enumerate(np.eye(2) * 1e-7):
        numeric = (relief.at(uv + along) - relief.at(uv - along)) / 2e-7
        np.testing.assert_allclose(numeric, relief.slope(uv)[:, axis], atol=1e-4)
