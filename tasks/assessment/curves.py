"""What a network's probabilities are worth: precision and recall at every threshold, and their calibration.

Everything is counted in one pass over each image, as histograms of the 256 levels that a probability has.
"""

import cv2
import numpy as np
import numpy.typing as npt

from schemas.evaluation import Curves, Levels
from tasks.assessment.evaluation import Mask, disc, near

Probability = npt.NDArray[np.uint8]  # (H, W), 255 × the probability

BINS = 10  # of the calibration


def levels(probability: Probability, truth: Mask, tolerance_px: int) -> Levels:
    """Of one image. A true pixel counts by the highest level within the tolerance."""
    reached = cv2.dilate(probability, disc(tolerance_px))
    which = (probability, probability[truth], probability[near(truth, tolerance_px)], reached[truth])
    return np.array([np.bincount(np.ravel(one), minlength=256) for one in which])


def curves(of_all: Levels, tolerance_px: int) -> Curves:
    """Of all pixels of all images, from the sum of their levels."""
    found, true, right, reached = of_all
    found_right, found_from, reached_from = (_from_level(n) for n in (right, found, reached))
    middle = (np.arange(256) / 255 * BINS).astype(int).clip(max=BINS - 1)
    pixels, cracks, said = (
        np.bincount(middle, weights, BINS) for weights in (found, true, found * np.arange(256) / 255)
    )
    some = pixels > 0
    return Curves(
        tolerance_px=tolerance_px,
        threshold=_rounded(np.arange(1, 256) / 255),
        precision=_rounded(found_right[1:] / np.maximum(found_from[1:], 1)),
        recall=_rounded(reached_from[1:] / max(reached_from[0], 1)),
        said=_rounded(said[some] / pixels[some]),
        was=_rounded(cracks[some] / pixels[some]),
    )


def _from_level(histogram: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """(256,) pixels of this level and above."""
    return np.cumsum(histogram[::-1])[::-1]


def _rounded(values: npt.NDArray[np.float64]) -> tuple[float, ...]:
    return tuple(round(float(v), 4) for v in values)
