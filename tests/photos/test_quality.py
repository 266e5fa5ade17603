import cv2
import numpy as np

from tasks.photos.quality import exposure, sharpness


def scene(seed: int) -> np.ndarray:
    """(600, 800, 3) texture of all sizes under a slope of light and a hard shadow, with sensor noise."""
    rng = np.random.default_rng(seed)
    grey = np.zeros((600, 800), np.float32)
    for k in range(6):
        coarse = rng.standard_normal((600 // 2**k + 2, 800 // 2**k + 2)).astype(np.float32)
        grey += cv2.resize(coarse, (800, 600), interpolation=cv2.INTER_CUBIC) * 1.5**k
    return 120 + 8 * grey / grey.std()


def photo(grey: np.ndarray, blur_px: float, seed: int) -> np.ndarray:
    seen = cv2.GaussianBlur(grey, (0, 0), blur_px) if blur_px else grey
    noisy = seen[..., None] + np.random.default_rng(seed).normal(0, 2, (*grey.shape, 3))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def test_blur_shows_whatever_the_light() -> None:
    plain = scene(1)
    shaded = scene(2)
    shaded[:, 300:] *= 0.4
    sloped = scene(3) * np.linspace(0.6, 1.6, 800, dtype=np.float32)
    sharp = [sharpness(photo(grey, 0.7, k)) for k, grey in enumerate((plain, shaded, sloped))]
    blurred = [sharpness(photo(grey, 4.0, k)) for k, grey in enumerate((plain, shaded, sloped))]
    assert max(sharp) < 1.2 * min(sharp)
    assert max(blurred) < 0.3 * min(sharp)


def test_one_grey_has_no_sharpness() -> None:
    assert sharpness(np.full((64, 64, 3), 128, np.uint8)) == 0.0


def test_exposure_is_mean_grey() -> None:
    assert exposure(np.full((64, 64, 3), 51, np.uint8)) == 0.2
