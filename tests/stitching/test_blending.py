"""Gains and multi-band blending."""

import numpy as np
import pytest

from tasks.stitching.blending import MultiBand
from tasks.stitching.gain import gain_table, srgb_to_linear


def test_one_layer_is_left_as_it_is() -> None:
    layer = np.random.default_rng(0).uniform(0, 255, (256, 320, 3)).astype(np.float32)
    blend = MultiBand(320, 256)
    blend.add(layer, np.ones((256, 320), np.float32), 0, 0)
    assert np.abs(blend.result().astype(float) - layer).max() <= 0.51


def test_layers_that_agree_show_no_seam() -> None:
    layer = np.random.default_rng(1).uniform(0, 255, (256, 320, 3)).astype(np.float32)
    left = np.zeros((256, 320), np.float32)
    left[:, :150] = 1
    blend = MultiBand(320, 256)
    blend.add(layer, left, 0, 0)
    blend.add(layer, 1 - left, 0, 0)
    assert np.abs(blend.result().astype(float) - layer).max() <= 0.51


def test_a_step_of_light_becomes_a_slope() -> None:
    """Two greys 20 apart, seam in the middle: no step of more than 1 a pixel, the ends unchanged."""
    mask = np.zeros((256, 640), np.float32)
    mask[:, :320] = 1
    blend = MultiBand(640, 256)
    blend.add(np.full((256, 640, 3), 110, np.float32), mask, 0, 0)
    blend.add(np.full((256, 640, 3), 130, np.float32), 1 - mask, 0, 0)
    row = blend.result()[128, :, 0].astype(int)
    assert np.abs(np.diff(row)).max() <= 1
    assert (row[0], row[-1]) == (110, 130)


def test_gains_act_on_linear_light() -> None:
    linear = srgb_to_linear()
    assert linear[188] == pytest.approx(0.5, abs=0.005)
    doubled = gain_table(2.0)
    assert doubled[137] == pytest.approx(188, abs=1.0)  # 0.25 → 0.5
    assert doubled.max() == 255.0
    np.testing.assert_allclose(gain_table(1.0), np.arange(256), atol=0.01)
