import numpy as np
import pytest
from skimage.filters import threshold_otsu

from schemas.detection import Peaks
from tasks.detection.global_threshold import from_peaks, otsu


def test_otsu_separates_as_scikit_image_does() -> None:
    rng = np.random.default_rng(0)
    for dark, bright in ((60, 160), (100, 140), (30, 220)):
        grey = np.concatenate([rng.normal(dark, 9, 3000), rng.normal(bright, 12, 9000)])
        grey = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
        ours = otsu(np.bincount(grey, minlength=256))
        theirs = threshold_otsu(grey)
        assert ((grey < ours) == (grey <= theirs)).mean() > 0.999


def test_between_the_surface_and_the_next_darker_peak() -> None:
    histogram = np.ones(256, dtype=int)
    assert from_peaks(histogram, Peaks(peaks=(20, 60, 150, 200), i_surface=150)) == 105
    assert from_peaks(histogram, Peaks(peaks=(2, 60, 150), i_blank=2, i_surface=60)) == otsu(histogram)


@pytest.mark.parametrize("level", [0, 77, 255])
def test_one_level_has_nothing_below(level: int) -> None:
    assert otsu(np.bincount([level] * 9, minlength=256)) == 0.0
