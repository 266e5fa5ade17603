import cv2
import numpy as np
import pytest

from tasks.detection import sizes
from tasks.detection.sizes import Answer, Logits, join
from tasks.detection.windows import Window


def of(logit: Logits, octave: int, joined: Logits | None = None) -> Answer:
    return Answer(logit, logit if joined is None else joined, 0, 0, octave)


def plain(value: float, side_px: int) -> Logits:
    return np.full((side_px, side_px), value, np.float32)


def test_a_size_heeds_the_next_smaller_one_where_that_sees_more_and_less() -> None:
    logit = np.zeros((1, 4), np.float32)
    half = np.array([[4.0, -4.0, 4.0, -4.0]], np.float32)
    sizes._heed(logit, half, np.array([[1.0, 1.0, 0.5, 0.0]], np.float32))
    assert np.allclose(logit, [[4.0 * sizes.SURER, -4.0 * sizes.LESS_SURE, 2.0 * sizes.SURER, 0.0]])


def test_what_is_wide_but_not_seen_at_half_the_size_is_no_crack_and_what_is_thin_may_be() -> None:
    logit = plain(-6.0, 128)
    logit[20:60, 20:100] = 4.0
    logit[90:94, 10:120] = 4.0
    unseen = plain(-5.0, 64)
    joined = join(of(logit, 0), (of(unseen, 1),)).joined
    assert joined[22:58, 22:98].max() < -4.0
    assert joined[90:94, 10:120].min() > 3.9
    seen = join(of(logit, 0), (of(plain(4.0, 64), 1),)).joined
    assert (seen == logit).all()


def test_what_half_the_size_sees_by_itself_is_no_less_a_crack_for_a_quarter_that_does_not() -> None:
    logit = plain(3.0, 64)
    doubted = of(plain(3.0, 32), 1, joined=plain(-5.0, 32))
    assert (join(of(logit, 0), (doubted,)).joined == 3.0).all()


def test_a_smaller_answer_is_enlarged_to_where_a_finer_one_lies() -> None:
    small = np.random.default_rng(1).normal(size=(40, 50)).astype(np.float32)
    whole = cv2.resize(small, (400, 320), interpolation=cv2.INTER_LINEAR)
    quarter = Answer(small, small, 64, 128, 3)
    fine = Answer(np.zeros((90, 77), np.float32), np.zeros((90, 77), np.float32), 64 + 40, 128 + 51, 0)
    assert np.allclose(quarter.joined_at(fine), whole[40:130, 51:128], atol=1e-6)
    half = Answer(np.zeros((60, 70), np.float32), np.zeros((60, 70), np.float32), 64 + 64, 128 + 96, 1)
    at_half = cv2.resize(small, (200, 160), interpolation=cv2.INTER_LINEAR)
    assert np.allclose(quarter.joined_at(half), at_half[32:92, 48:118], atol=1e-6)


def test_an_answer_within_a_window_is_the_part_of_it_there() -> None:
    logit = np.arange(400, dtype=np.float32).reshape(20, 20)
    part = Answer(logit, logit + 1, 100, 200, 1).within(Window(55, 60, 103, 120))
    assert (part.alone == logit[5:10, 3:20]).all() and (part.joined == logit[5:10, 3:20] + 1).all()
    assert (part.top_px, part.left_px, part.octave) == (110, 206, 1)


def test_bands_are_joined_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    full, half, quarter = (
        cv2.GaussianBlur(rng.normal(0, 40, (side, side)).astype(np.float32), (0, 0), 4.0)
        for side in (256, 128, 64)
    )
    wider = (of(quarter, 2), of(half, 1))
    joined = []
    for rows in (sizes.BAND_ROWS, 32):
        monkeypatch.setattr(sizes, "BAND_ROWS", rows)
        joined.append(join(of(full, 0), wider).joined)
    assert (joined[0] == joined[1]).all() and (joined[0] != full).mean() > 0.1


@pytest.mark.parametrize("shape", [(1, 1), (4, 1), (1, 4), (4, 4), (3, 2)])
def test_probabilities_of_the_smallest_answers(shape: tuple[int, int]) -> None:
    """OpenCV takes four rows of one number for one number of four channels."""
    logit = np.linspace(-2.0, 2.0, shape[0] * shape[1], dtype=np.float32).reshape(shape)
    np.testing.assert_allclose(sizes._probable(logit), 1.0 / (1.0 + np.exp(-logit)), rtol=1e-6)
