import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tasks.assessment.evaluation import count, evaluate, scores


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
    exact, near = evaluate("hairline", [(line(5, 9), line(5, 9)), (nothing, line(3))])
    assert (exact.tolerance_px, near.tolerance_px, exact.images) == (0, 2, 2)
    assert exact.aggregate.recall == pytest.approx(0.9) and exact.mean.recall == pytest.approx(0.5)


@given(arrays(bool, (12, 12)), arrays(bool, (12, 12)), st.integers(0, 4))
def test_more_tolerance_never_hurts(found: np.ndarray, truth: np.ndarray, tolerance: int) -> None:
    tight, loose = scores(count(found, truth, tolerance)), scores(count(found, truth, tolerance + 1))
    assert loose.precision >= tight.precision and loose.recall >= tight.recall
    assert 0.0 <= tight.f1 <= 1.0
