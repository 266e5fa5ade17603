import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tasks.assessment.evaluation import count, evaluate, scores, tally


def line(x: int, thickness: int = 1) -> np.ndarray:
    mask = np.zeros((40, 40), dtype=bool)
    mask[:, x : x + thickness] = True
    return mask


def test_counted_by_hand() -> None:
    found, truth = line(10, 4), line(12, 4)  # half of each lies on the other
    exact = scores(count(found, truth, 0))
    assert (exact.precision, exact.recall, exact.f1) == (0.5, 0.5, 0.5)
    near = scores(count(found, truth, 2))
    assert (near.precision, near.recall, near.f1) == (1.0, 1.0, 1.0)


def test_tolerance_is_a_euclidean_distance() -> None:
    found, truth = np.zeros((9, 9), dtype=bool), np.zeros((9, 9), dtype=bool)
    found[4, 4], truth[6, 6] = True, True  # 2.8 px apart
    assert scores(count(found, truth, 2)).f1 == 0.0
    truth[6, 6], truth[6, 4] = False, True
    assert scores(count(found, truth, 2)).f1 == 1.0


def test_one_pixel_more_on_a_perfect_line_of_four() -> None:
    assert scores(count(line(9, 6), line(10, 4), 0)).f1 == pytest.approx(0.8)


def test_nothing_found_and_nothing_there() -> None:
    nothing = np.zeros((5, 5), dtype=bool)
    assert scores(count(nothing, nothing, 2)).f1 == 1.0
    assert scores(count(nothing, ~nothing, 2)).f1 == 0.0
    assert scores(count(~nothing, nothing, 2)).f1 == 0.0


def test_aggregate_weighs_pixels_and_mean_weighs_images() -> None:
    nothing = np.zeros((40, 40), dtype=bool)
    exact, near, loose = evaluate("hairline", [tally(line(5, 9), line(5, 9)), tally(nothing, line(3))])
    assert (exact.tolerance_px, near.tolerance_px, loose.tolerance_px, exact.images) == (0, 2, 5, 2)
    assert exact.aggregate.recall == pytest.approx(0.9) and exact.mean.recall == pytest.approx(0.5)


def test_length_does_not_depend_on_how_wide_a_mask_is_drawn() -> None:
    """A rim of two pixels costs the area its precision, the centreline nothing."""
    _, _, loose = evaluate("hairline", [tally(line(8, 8), line(10, 4))])
    assert loose.length.precision == loose.length.recall == 1.0
    wrong, truth = line(10), line(10) | line(30)
    _, near, _ = evaluate("hairline", [tally(wrong, truth)])
    assert (near.length.precision, near.length.recall) == (1.0, pytest.approx(0.5))
    _, near, _ = evaluate("hairline", [tally(truth, wrong)])
    assert near.false_length_per_mpx == pytest.approx(40 / 1600 * 1e6, rel=0.05)


def test_the_interval_holds_the_figure_and_narrows_with_more_images() -> None:
    pairs = [tally(line(5, 4), line(5, 4)), tally(line(5), line(20)), tally(line(7, 2), line(7, 4))]
    few, many = (evaluate("hairline", pairs * n)[0] for n in (2, 40))
    for one in (few, many):
        low, high = one.f1_interval
        assert low <= one.aggregate.f1 <= high
    assert np.ptp(many.f1_interval) < 0.5 * np.ptp(few.f1_interval)
    assert few.f1_interval == evaluate("hairline", pairs * 2)[0].f1_interval


@given(arrays(bool, (12, 12)), arrays(bool, (12, 12)), st.integers(0, 4))
def test_more_tolerance_never_hurts(found: np.ndarray, truth: np.ndarray, tolerance: int) -> None:
    tight, loose = scores(count(found, truth, tolerance)), scores(count(found, truth, tolerance + 1))
    assert loose.precision >= tight.precision and loose.recall >= tight.recall
    assert 0.0 <= tight.f1 <= 1.0
