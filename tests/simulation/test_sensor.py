import numpy as np
import pytest

from schemas.camera import Camera
from tasks.simulation.sensor import FULL_WELL, READ_NOISE, automatic_gain, develop

CAMERA = Camera(width_px=256, height_px=192, focal_px=800.0)
MIDDLE = np.s_[80:112, 108:148]


def linear(srgb: np.ndarray) -> np.ndarray:
    s = srgb.astype(float) / 255
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("level", [0.05, 0.2, 0.6])
def test_even_light_comes_back_after_undoing_srgb(level: float) -> None:
    light = np.full((192, 256), level, np.float32)
    photo = develop(light, CAMERA, 1.0, np.random.default_rng(0))
    green = linear(photo[MIDDLE])[..., 1]
    assert green.mean() == pytest.approx(level, rel=0.02)


def test_noise_is_that_of_counted_electrons() -> None:
    """Before demosaicking averages and sharpening raises it, the noise is √(N + read²)."""
    light = np.full((192, 256), 0.2, np.float32)
    rng = np.random.default_rng(1)
    noise = linear(develop(light, CAMERA, 1.0, rng)[MIDDLE])[..., 1].std() / 0.2
    electrons = 0.2 * FULL_WELL
    expected = np.sqrt(electrons + READ_NOISE**2) / electrons
    assert 0.5 * expected < noise < 1.6 * expected


def test_the_corners_are_darker() -> None:
    photo = develop(np.full((192, 256), 0.4, np.float32), CAMERA, 1.0, np.random.default_rng(2))
    assert linear(photo[:8, :8]).mean() == pytest.approx(0.75 * linear(photo[MIDDLE]).mean(), rel=0.04)


def test_colours_go_to_their_own_channels() -> None:
    """RGGB: red light falls on even rows and columns, blue on odd ones."""
    light = np.full((192, 256), 0.05, np.float32)
    light[::2, ::2] = 0.5
    photo = develop(light, CAMERA, 1.0, np.random.default_rng(3))[MIDDLE].reshape(-1, 3).mean(axis=0)
    assert photo[0] > photo[1] + 60 and photo[0] > photo[2] + 60
    light = np.full((192, 256), 0.05, np.float32)
    light[1::2, 1::2] = 0.5
    photo = develop(light, CAMERA, 1.0, np.random.default_rng(3))[MIDDLE].reshape(-1, 3).mean(axis=0)
    assert photo[2] > photo[1] + 60


def test_automatic_exposure_brings_any_scene_to_the_same_mean() -> None:
    scene = np.random.default_rng(4).uniform(0.1, 0.5, (192, 256)).astype(np.float32)
    for brightness in (0.01, 1.0, 50.0):
        light = scene * np.float32(brightness)
        assert float(light.mean()) * automatic_gain(light) == pytest.approx(0.2, rel=0.05)


def test_too_much_light_saturates() -> None:
    photo = develop(np.full((192, 256), 9.0, np.float32), CAMERA, 1.0, np.random.default_rng(5))
    assert photo[MIDDLE].min() >= 250
