import cv2
import numpy as np
import pytest

from schemas.photo import BLURRED
from tasks.photos.quality import clipped, exposure, sharpness
from tasks.photos.reading import read_photo
from tests.development_data import development_data


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
    sharp = [sharpness(photo(grey, 0.7, k))[0] for k, grey in enumerate((plain, shaded, sloped))]
    blurred = [sharpness(photo(grey, 4.0, k))[0] for k, grey in enumerate((plain, shaded, sloped))]
    assert max(sharp) < 1.2 * min(sharp)
    assert max(blurred) < 0.3 * min(sharp)


@pytest.mark.parametrize("towards_deg", [0, 30, 45, 90, 135])
def test_motion_shows_along_its_direction(towards_deg: float) -> None:
    streak = np.zeros((25, 25), np.float32)
    for t in np.linspace(-10, 10, 81):
        a = np.radians(towards_deg)
        streak[round(12 - t * np.sin(a)), round(12 + t * np.cos(a))] = 1
    still, moved = scene(5), cv2.filter2D(scene(5), -1, streak / streak.sum())
    _, before = sharpness(photo(still, 0.7, 1))
    _, after = sharpness(photo(moved, 0.7, 2))
    shares = np.array(after) / before
    assert shares.min() < BLURRED
    assert shares.max() > shares.min() * 1.5


def test_real_photos_are_not_called_blurred_and_shaken_ones_are() -> None:
    folder = development_data("photos/brighton_beach")
    pictures = [read_photo(path, path.name).pixels for path in sorted(folder.glob("*.JPG"))[::4]]
    along = np.array([sharpness(pixels)[1] for pixels in pictures])
    assert (along / np.median(along, axis=0)).min() > 2 * BLURRED
    shaken = cv2.blur(pictures[0], (19, 1))
    assert (np.array(sharpness(shaken)[1]) / np.median(along, axis=0)).min() < BLURRED
    assert clipped(pictures[0])[0] < 0.01


def test_clipped_pixels_are_counted() -> None:
    pixels = np.full((10, 10, 3), 128, np.uint8)
    pixels[:3], pixels[3:5], pixels[5, :, 0] = 255, 0, 255
    assert clipped(pixels) == (0.3, 0.2)


def test_one_grey_has_no_sharpness() -> None:
    assert sharpness(np.full((64, 64, 3), 128, np.uint8)) == (0.0, (0.0, 0.0, 0.0, 0.0))


def test_exposure_is_mean_grey() -> None:
    assert exposure(np.full((64, 64, 3), 51, np.uint8)) == 0.2
