"""Gains and multi-band blending."""

import cv2
import numpy as np
import pytest

from schemas.camera import Camera
from tasks.stitching.blending import MultiBand
from tasks.stitching.gain import Light, gain_table, relit, solve_light, srgb_to_linear
from tasks.stitching.view import FACING, View

RIM = 8  # of a window, where nothing is shown


def add(blend: MultiBand, layer: np.ndarray, mask: np.ndarray) -> None:
    half = np.asarray(cv2.pyrDown(layer), np.float32)
    blend.add(half, mask, 0, 0)
    inner = (slice(RIM, -RIM), slice(RIM, -RIM))
    around = half[RIM // 2 - 2 : 2 - RIM // 2, RIM // 2 - 2 : 2 - RIM // 2]
    blend.add_finest(layer[inner], around, mask[inner] > 0, 0, 0)


def test_one_layer_is_left_as_it_is() -> None:
    layer = np.random.default_rng(0).uniform(0, 255, (256, 320, 3)).astype(np.float32)
    blend = MultiBand(320, 256, RIM)
    add(blend, layer, np.ones((256, 320), np.float32))
    assert np.abs(blend.result().astype(float) - layer[RIM:-RIM, RIM:-RIM]).max() <= 0.51


def test_what_a_layer_has_at_half_its_size_need_not_be_what_it_has_at_full_size() -> None:
    """Where it is alone it is shown as it is."""
    rng = np.random.default_rng(2)
    layer = rng.uniform(50, 200, (256, 320, 3)).astype(np.float32)
    half = np.asarray(cv2.pyrDown(layer), np.float32) + rng.uniform(-9, 9, (128, 160, 3)).astype(np.float32)
    blend, everywhere = MultiBand(320, 256, RIM), np.ones((256, 320), np.float32)
    blend.add(half, everywhere, 0, 0)
    inner = (slice(RIM, -RIM), slice(RIM, -RIM))
    blend.add_finest(layer[inner], half[2:-2, 2:-2], everywhere[inner] > 0, 0, 0)
    assert np.abs(blend.result().astype(float) - layer[inner]).max() <= 0.51


def test_layers_that_agree_show_no_seam() -> None:
    layer = np.random.default_rng(1).uniform(0, 255, (256, 320, 3)).astype(np.float32)
    left = np.zeros((256, 320), np.float32)
    left[:, :150] = 1
    blend = MultiBand(320, 256, RIM)
    add(blend, layer, left)
    add(blend, layer, 1 - left)
    assert np.abs(blend.result().astype(float) - layer[RIM:-RIM, RIM:-RIM]).max() <= 0.51


def test_a_step_of_light_becomes_a_slope() -> None:
    """Two greys 20 apart, seam in the middle: no step of more than 1 a pixel, the ends unchanged."""
    mask = np.zeros((256, 640), np.float32)
    mask[:, :320] = 1
    blend = MultiBand(640, 256, RIM)
    add(blend, np.full((256, 640, 3), 110, np.float32), mask)
    add(blend, np.full((256, 640, 3), 130, np.float32), 1 - mask)
    row = blend.result().astype(float)[128, :, 0]
    assert np.abs(np.diff(row)).max() <= 1
    assert (row[0], row[-1]) == (110, 130)


def test_gains_act_on_linear_light() -> None:
    linear = srgb_to_linear()
    assert linear[188] == pytest.approx(0.5, abs=0.005)
    doubled = gain_table(2.0)
    assert doubled[137] == pytest.approx(188, abs=1.0)  # 0.25 → 0.5
    assert doubled.max() == 255.0
    np.testing.assert_allclose(gain_table(1.0), np.arange(256), atol=0.01)


CAMERA = Camera(width_px=480, height_px=360, focal_px=480.0)
FALLOFF = 0.3  # of the light, lost in the corners
SET = np.array([0.9, 1.1, 1.2, 0.85, 1.0, 1.05])  # exposures


def row_of_photos(shine: float = 0.0) -> tuple[list[View], list[np.ndarray]]:
    """Six photos of a grey wall, 60 % overlap; each darker in its corners and, by `shine`, to its right."""
    views, photos = [], []
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:360, :480]
    rho2 = ((x - 239.5) ** 2 + (y - 179.5) ** 2) * 4 / (480**2 + 360**2)
    for k, exposed in enumerate(SET):
        views.append(View(CAMERA, FACING, np.array([0.4 * k, 0.0, 1.0])))
        light = 0.2 * exposed * (1 - FALLOFF * rho2) * np.exp(-shine * (x / 480 - 0.5))
        srgb = 255 * (1.055 * (light * np.array([[[1.0]], [[0.9]], [[0.8]]])) ** (1 / 2.4) - 0.055)
        noisy = np.moveaxis(srgb, 0, 2) + rng.normal(0, 1, (360, 480, 3))
        photos.append(np.clip(np.rint(noisy), 0, 255).astype(np.uint8))
    return views, photos


def solved(views: list[View], photos: list[np.ndarray], metered: list[float | None]) -> Light:
    pairs = [(k, k + 1) for k in range(5)] + [(k, k + 2) for k in range(4)]
    return solve_light(views, photos.__getitem__, pairs, metered, lambda _: None)


def test_exposure_and_falloff_are_told_apart() -> None:
    views, photos = row_of_photos()
    light = solved(views, photos, [None] * 6)
    evened = light.gains[:, 1] * SET
    assert np.abs(evened / evened.mean() - 1).max() < 0.005
    at = np.stack(np.meshgrid(np.arange(480.0), np.arange(360.0)), axis=-1).astype(np.float32)
    as_it_is = np.stack([np.arange(256, dtype=np.float32)] * 3, axis=1)
    flat = relit(photos[2], at, views[2], as_it_is, light.falloff[2])
    middle, corner = flat[170:190, 230:250].mean(), flat[:20, :20].mean()
    assert corner == pytest.approx(middle, rel=0.02)
    assert photos[2][:20, :20].mean() < 0.9 * middle


def test_gains_do_not_drift_where_the_camera_says_what_it_set() -> None:
    """A wall that shines more to the left of each photo looks like photos that grow darker to the right."""
    views, photos = row_of_photos(shine=0.3)
    drift = [
        float(np.ptp(np.log(solved(views, photos, metered).gains[:, 1] * SET)))
        for metered in ([None] * 6, list(np.log2(SET)))
    ]
    assert drift[0] > 0.4
    assert drift[1] < 0.5 * drift[0]
