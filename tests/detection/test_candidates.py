import numpy as np
import pytest

from tasks.detection.candidates import EDGE, SURE, candidates, score_of, strength
from tasks.detection.components import components


def line(levels: tuple[int, ...], length: int = 60) -> np.ndarray:
    """A level line, brightest in its middle rows."""
    p = np.zeros((30, 100), np.uint8)
    for row, level in enumerate(levels):
        p[10 + row, 20 : 20 + length] = level
    return p


def test_strength_is_that_of_the_middle_and_not_of_the_rim() -> None:
    p = line((130, 250, 250, 130))
    assert strength(components(p >= EDGE), p)[1] == pytest.approx(250 / 255)
    p = line((200, 200, 200))
    assert strength(components(p >= EDGE), p)[1] == pytest.approx(200 / 255)


def test_a_candidate_needs_a_pixel_that_is_sure() -> None:
    faint, sure = candidates(line((SURE - 1,))), candidates(line((SURE,)))
    assert faint.score[1] == 0.0 < sure.score[1]
    assert candidates(np.zeros((5, 5), np.uint8)).score.tolist() == [0.0]


def test_stronger_and_longer_is_likelier() -> None:
    core, extent = np.linspace(0.5, 1.0, 20), np.geomspace(30, 3000, 20)
    assert (np.diff(score_of(core, np.full(20, 80.0))) >= 0).all()
    assert (np.diff(score_of(np.full(20, 0.8), extent)) >= 0).all()
    assert 0.0 < score_of(np.array([0.0]), np.array([1.0]))[0] < score_of(core[-1:], extent[-1:])[0] < 1.0


def test_a_score_says_where() -> None:
    given = candidates(line((250, 250)))
    (one,) = given.at(given.score > 0)
    assert one.position_px == (50.0, 11.0) and one.score == round(float(given.score[1]), 3)
