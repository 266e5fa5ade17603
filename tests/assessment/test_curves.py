import numpy as np
import pytest

from tasks.assessment.curves import curves, levels
from tasks.assessment.evaluation import count, scores


def rough(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A crack down the middle and a probability that knows it, with noise."""
    rng = np.random.default_rng(seed)
    truth = np.zeros((60, 60), dtype=bool)
    truth[:, 29:32] = True
    return np.clip(120 * truth + rng.integers(0, 136, truth.shape), 0, 255).astype(np.uint8), truth


@pytest.mark.parametrize("tolerance_px", [0, 2])
def test_each_threshold_scores_as_its_mask_does(tolerance_px: int) -> None:
    images = [rough(1), rough(2)]
    found = curves(sum(levels(*image, tolerance_px) for image in images), tolerance_px)
    for level in (1, 90, 128, 200, 255):
        counts = np.sum([count(p >= level, truth, tolerance_px) for p, truth in images], axis=0)
        right, all_found, true_found, true = counts.tolist()
        assert found.precision[level - 1] == pytest.approx(right / max(all_found, 1), abs=1e-4)
        assert found.recall[level - 1] == pytest.approx(true_found / true, abs=1e-4)


def test_probabilities_that_are_frequencies_are_calibrated() -> None:
    rng = np.random.default_rng(0)
    probability = rng.integers(0, 256, (800, 800)).astype(np.uint8)
    truth = rng.random(probability.shape) < probability / 255
    found = curves(levels(probability, truth, 0), 0)
    assert np.abs(np.array(found.said) - found.was).max() < 0.01
    overstated = curves(levels(probability, truth & (rng.random(truth.shape) < 0.5), 0), 0)
    assert overstated.was[-1] == pytest.approx(overstated.said[-1] / 2, abs=0.02)


def test_nothing_drawn_and_nothing_found() -> None:
    nothing = np.zeros((9, 9), dtype=np.uint8)
    found = curves(levels(nothing, nothing > 0, 2), 2)
    assert set(found.precision) == set(found.recall) == {0.0} and found.said == (0.0,)
    assert scores(count(nothing > 0, nothing > 0, 2)).f1 == 1.0
