import cv2
import numpy as np
import pytest
from skimage.filters import threshold_sauvola

from tasks.detection.sauvola import grey_of, moments_of_valid, sauvola
from tests.development_data import development_data


def textured(height: int, width: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    rough = (
        cv2.GaussianBlur(rng.normal(size=(height, width)), (0, 0), 2.0) * 90
        + rng.normal(size=(height, width)) * 6
    )
    return np.clip(rough + np.linspace(90, 200, width), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("window", [15, 31, 63, 127])
def test_equals_scikit_image(window: int) -> None:
    grey = textured(150, 210)
    theirs = grey < threshold_sauvola(grey.astype(float), window_size=window, k=0.5, r=128)
    ours = sauvola(grey, window, 0.5, 128.0)
    assert (ours == theirs).mean() >= 0.999
    assert ours.any() and not ours.all()


def test_equals_scikit_image_on_photos() -> None:
    folder = development_data("cracks/uav/images")
    for path in sorted(folder.glob("*.png"))[::60]:
        grey = grey_of(np.ascontiguousarray(cv2.imread(str(path))[..., ::-1]))
        theirs = grey < threshold_sauvola(grey.astype(float), window_size=63, k=0.5, r=128)
        assert (sauvola(grey, 63, 0.5, 128.0) == theirs).mean() >= 0.999


def test_the_moments_are_those_of_the_valid_pixels() -> None:
    grey = textured(40, 50)
    valid = np.random.default_rng(1).random(grey.shape) < 0.6
    local = moments_of_valid(grey, valid, 15)
    for y, x in ((0, 0), (20, 25), (39, 49), (7, 3)):
        rows, columns = slice(max(0, y - 7), y + 8), slice(max(0, x - 7), x + 8)
        values = grey[rows, columns][valid[rows, columns]].astype(float)
        assert local.mean[y, x] == pytest.approx(values.mean())
        assert local.deviation[y, x] == pytest.approx(values.std(), abs=1e-6)


def test_no_valid_pixel_at_all() -> None:
    local = moments_of_valid(textured(20, 20), np.zeros((20, 20), dtype=bool), 15)
    assert not local.mean.any() and not local.deviation.any()


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (5, 7)])
def test_images_smaller_than_the_window(shape: tuple[int, int]) -> None:
    assert sauvola(textured(*shape), 63, 0.5, 128.0).shape == shape
