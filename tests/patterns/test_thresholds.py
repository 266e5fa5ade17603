import numpy as np
import pytest

from tasks.patterns.thresholds import RedHistograms, paper_thresholds


def mode(level: float, pixels: int, spread: float = 6.0) -> np.ndarray:
    values = np.random.default_rng(int(level)).normal(level, spread, pixels)
    return np.bincount(np.clip(np.rint(values), 0, 255).astype(int), minlength=256)


NONE = np.zeros(256, dtype=int)
BLANK = np.bincount([0] * 20_000, minlength=256)


def test_the_papers_case() -> None:
    found = paper_thresholds(RedHistograms(BLANK, mode(140, 80_000), mode(230, 6_000)))
    assert found.i_blank is not None and found.i_blank <= 1
    assert found.i_surface == pytest.approx(140, abs=3) and found.i_pattern == pytest.approx(230, abs=3)
    assert found.t1 == (found.i_blank + found.i_surface) / 2
    assert found.t2 == (found.i_surface + found.i_pattern) / 2
    assert found.note == ""


def test_without_blank_pixels_the_darkest_peak_is_not_taken_for_them() -> None:
    sun_and_shade = mode(170, 60_000) + mode(70, 40_000)
    found = paper_thresholds(RedHistograms(NONE, sun_and_shade, NONE))
    assert (found.i_blank, found.t1, found.i_pattern, found.t2) == (None, None, None, None)
    assert found.i_surface == pytest.approx(170, abs=3)
    assert "nothing is blank" in found.note and "no markers" in found.note


def test_concrete_brighter_than_its_markers_gives_no_t2() -> None:
    found = paper_thresholds(RedHistograms(BLANK, mode(215, 80_000), mode(150, 6_000)))
    assert found.i_pattern is None and found.t2 is None and "masked by their colour" in found.note


def test_an_image_that_is_all_blank_has_nothing_to_inspect() -> None:
    found = paper_thresholds(RedHistograms(BLANK, NONE, NONE))
    assert found.i_surface is None and "nothing to inspect" in found.note
