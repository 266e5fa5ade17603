from itertools import pairwise

import numpy as np
import pytest

from tasks.simulation.grain import SPECTRUM_SLOPE, fine_tile, power_law


def test_the_spectrum_falls_as_measured() -> None:
    texel_m = 0.002
    noise = power_law(np.random.default_rng(0), (512, 512), texel_m, 0.03)
    window = np.hanning(512)
    power = np.abs(np.fft.fft2(noise * window * window[:, None])) ** 2
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(512), np.fft.fftfreq(512)))
    edges = 0.01 * 2.0 ** np.arange(6)
    bands = [power[(f >= a) & (f < b)].mean() for a, b in pairwise(edges)]
    slope = np.polyfit(np.log(edges[:-1]), np.log(bands), 1)[0]
    assert slope == pytest.approx(SPECTRUM_SLOPE, abs=0.15)


def test_an_octave_has_the_rms_asked_for() -> None:
    noise = power_law(np.random.default_rng(1), (1024, 1024), 0.001, 0.03)
    spectrum = np.fft.fft2(noise)
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(1024, 0.001), np.fft.fftfreq(1024, 0.001)))
    band = np.fft.ifft2(np.where((f >= 35.0) & (f < 70.0), spectrum, 0)).real
    assert band.std() == pytest.approx(0.03, rel=0.05)


def test_wood_is_drawn_out_along_its_fibres() -> None:
    noise = power_law(np.random.default_rng(2), (400, 400), 0.001, 0.03, stretch=12.0)
    along, across = np.diff(noise, axis=0).std(), np.diff(noise, axis=1).std()
    assert across > 3 * along


def test_a_fine_tile_repeats_without_a_seam_and_is_even() -> None:
    tile = fine_tile(1, 0.00025, 0.03, 1.0).astype(float)
    inside, seam = np.abs(np.diff(tile, axis=0)).mean(), np.abs(tile[0] - tile[-1]).mean()
    assert seam == pytest.approx(inside, rel=0.1)
    assert abs(tile.mean()) < 0.5  # of 127


def test_the_same_seed_gives_the_same_noise() -> None:
    a, b, c = (power_law(np.random.default_rng(s), (64, 64), 0.01, 0.03) for s in (5, 5, 6))
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, c)
