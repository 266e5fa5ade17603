import cv2
import numpy as np
import pytest

from tasks.connected import Marked
from tasks.detection import candidates as judged
from tasks.detection.candidates import REACH_PX, Candidates, features, strength
from tasks.detection.components import Components, components
from tasks.detection.network import OUR_LIMITS, USUAL_LIMITS, Limits

SURE = OUR_LIMITS.sure


def candidates(p: np.ndarray, limits: Limits) -> Candidates:
    return judged.candidates(likely(p, limits), limits)


def likely(p: np.ndarray, limits: Limits = OUR_LIMITS) -> Marked:
    return Marked.of_levels(np.where(p >= limits.edge, p, np.uint8(0)))


def label_at(found: Components, y: int, x: int) -> int:
    (one,) = np.flatnonzero((found.pixels.y == y) & (found.pixels.x == x))
    return int(found.label[one])


def line(levels: tuple[int, ...], length: int = 60) -> np.ndarray:
    """A level line, brightest in its middle rows."""
    p = np.zeros((30, 100), np.uint8)
    for row, level in enumerate(levels):
        p[10 + row, 20 : 20 + length] = level
    return p


def test_strength_is_that_of_the_middle_and_not_of_the_rim() -> None:
    p = line((130, 250, 250, 130))
    assert strength(components(likely(p)))[1] == pytest.approx(250 / 255)
    p = line((200, 200, 200))
    assert strength(components(likely(p)))[1] == pytest.approx(200 / 255)


def test_a_candidate_needs_a_pixel_that_is_sure() -> None:
    faint, sure = (candidates(line((level,)), OUR_LIMITS) for level in (SURE - 1, SURE))
    assert faint.score.tolist() == [0.0] and sure.score[1] > 0.0
    assert candidates(np.zeros((5, 5), np.uint8), OUR_LIMITS).score.tolist() == [0.0]


def test_the_rim_of_a_sure_crack_is_none_and_as_likely_a_faint_crack_is_whole() -> None:
    rim = int(judged.RIM * 250) - 1
    sure = candidates(line((rim, 250, rim)), OUR_LIMITS).found
    assert set(sure.pixels.y.tolist()) == {11} and sure.area_px[1] == 60
    faint = candidates(line((rim, SURE, rim)), OUR_LIMITS).found
    assert set(faint.pixels.y.tolist()) == {10, 11, 12} and faint.area_px[1] == 180


def test_what_is_likelier_no_crack_is_none_by_a_guest() -> None:
    p = line((120, 120))
    assert candidates(p, OUR_LIMITS).score.max() > 0.0 == candidates(p, USUAL_LIMITS).score.max()


def test_stronger_is_likelier() -> None:
    faint, strong = (candidates(line((level,)), OUR_LIMITS).score[1] for level in (150, 250))
    assert 0.0 < faint < strong < 1.0


def test_of_two_as_strong_and_as_bent_the_slender_one_is_likelier() -> None:
    stubby, slender = (
        features(components(likely(line((200,), 12)))),
        features(components(likely(line((200,))))),
    )
    assert stubby[1, 3] == pytest.approx(np.log((12**2 + 1) / 12))
    assert slender[1, 3] == pytest.approx(np.log((60**2 + 1) / 60))
    alike = np.repeat(slender[1:2], 2, axis=0)
    alike[0, 3] = stubby[1, 3]
    assert np.diff(judged.score_of(alike))[0] > 0.02


def test_bend_is_least_for_a_ruled_line_and_none_for_a_ring() -> None:
    p = np.zeros((200, 300), np.uint8)
    cv2.line(p, (10, 20), (290, 60), 250, 3)
    wave = np.column_stack([np.arange(10, 290), 120 + 15 * np.sin(np.arange(280) / 30)])
    cv2.polylines(p, [np.rint(wave).astype(np.int32)], False, 250, 3)
    cv2.circle(p, (150, 175), 18, 250, 2)
    found = components(likely(p))
    of_line, of_wave, of_ring = (
        features(found)[label_at(found, y, x), 1] for x, y in ((10, 20), (10, 120), (168, 175))
    )
    assert of_line < -4.0 < of_wave < -1.0 < of_ring <= 0.0


def test_pieces_hardly_apart_are_one_candidate() -> None:
    p = line((250, 250))
    whole = candidates(p, OUR_LIMITS).score[1]
    p[:, 48 : 48 + 2 * REACH_PX] = 0
    assert candidates(p, OUR_LIMITS).score.tolist() == pytest.approx([0.0, whole], abs=0.02)
    p[:, 48 + 2 * REACH_PX] = 0
    assert len(candidates(p, OUR_LIMITS).score) == 3


def test_a_piece_that_is_not_sure_itself_joins_none() -> None:
    p = line((250, 250))
    p[15, 20:80] = SURE - 1
    assert set(candidates(p, OUR_LIMITS).found.pixels.y.tolist()) == {10, 11}


def test_a_score_says_where() -> None:
    given = candidates(line((250, 250)), OUR_LIMITS)
    (one,) = given.at(given.score > 0)
    assert one.position_px == (50.0, 11.0) and one.score == round(float(given.score[1]), 3)
