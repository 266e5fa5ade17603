import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tasks.patterns.peaks import dominant_peaks


def modes(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Centres of well separated modes of unequal height, and a histogram sampled from them."""
    while True:
        centres, spreads = np.sort(rng.uniform(15, 240, count)), rng.uniform(4, 14, count)
        if (np.diff(centres) > 3.2 * (spreads[1:] + spreads[:-1])).all():
            break
    shares = rng.uniform(0.1, 1.0, count)
    pixels = (shares / shares.sum() * 10 ** rng.uniform(4.3, 6.5)).astype(int)
    values = np.concatenate([rng.normal(c, s, n) for c, s, n in zip(centres, spreads, pixels, strict=True)])
    levels = np.rint(values).astype(int)
    return centres, np.bincount(levels[(levels >= 0) & (levels < 256)], minlength=256)


def test_finds_number_and_place_of_modes() -> None:
    rng = np.random.default_rng(7)
    right = 0
    for _ in range(200):
        centres, histogram = modes(rng, int(rng.integers(2, 5)))
        found = dominant_peaks(histogram)
        right += len(found) == len(centres) and bool(np.abs(np.array(found) - centres).max() <= 3)
    assert right >= 190


def test_a_shoulder_is_no_peak() -> None:
    x = np.arange(256)
    main, shoulder = np.exp(-(((x - 150) / 12) ** 2) / 2), 0.12 * np.exp(-(((x - 120) / 9) ** 2) / 2)
    assert dominant_peaks((1e5 * (main + shoulder)).astype(int)) == (150,)


def test_a_low_mode_between_two_high_ones_stays() -> None:
    x = np.arange(256)
    heights = sum(h * np.exp(-(((x - c) / 8) ** 2) / 2) for h, c in ((1.0, 40), (0.2, 120), (1.0, 200)))
    assert dominant_peaks((1e5 * heights).astype(int)) == (40, 120, 200)


def test_peaks_at_both_ends_count() -> None:
    histogram = np.zeros(256, dtype=int)
    histogram[0], histogram[255] = 5000, 3000
    histogram[120:125] = 2000
    found = dominant_peaks(histogram)
    assert found[0] <= 1 and found[-1] >= 254 and len(found) == 3


@pytest.mark.parametrize("level", [0, 128, 255])
def test_one_level_is_one_peak(level: int) -> None:
    found = dominant_peaks(np.bincount([level] * 100, minlength=256))
    assert len(found) == 1 and abs(found[0] - level) <= 1


def test_nothing_has_no_peak() -> None:
    assert dominant_peaks(np.zeros(256, dtype=int)) == ()


@given(st.lists(st.integers(0, 10_000), min_size=256, max_size=256))
def test_any_histogram_gives_ascending_levels(counts: list[int]) -> None:
    found = dominant_peaks(np.array(counts))
    assert list(found) == sorted(set(found)) and all(0 <= p <= 255 for p in found)
    assert bool(found) == any(counts)
