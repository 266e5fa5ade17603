import numpy as np
import pytest

from tasks.simulation.face import Face, FaceArrays
from tasks.simulation.light import BOUNCE, Daylight, light_map

NOON = Daylight.of(azimuth_deg=180.0, elevation_deg=45.0, sun=2.0, sky=1.0)
FLOOR = Face("floor", (-2.0, -2.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 4.0, 4.0)
ROOF = Face("roof", (-9.0, -0.5, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 18.0, 1.0)


def test_an_open_floor_gets_all_sky_and_the_suns_cosine() -> None:
    light = light_map(FLOOR, FaceArrays.of((FLOOR,)), NOON, 0.1).irradiance
    np.testing.assert_allclose(light, 1.0 + 2.0 * np.sin(np.radians(45)), rtol=1e-5)


def test_a_roof_throws_its_shadow_where_the_sun_says() -> None:
    """A roof 1 m up, sun 45° high in the south: the shadow lies 1 m north of the roof."""
    light = light_map(FLOOR, FaceArrays.of((FLOOR, ROOF)), NOON, 0.05)
    column = light.irradiance[:, 40]
    y = np.arange(len(column)) * 0.05 - 2.0
    lit = column > 1.2
    assert y[~lit].min() == pytest.approx(0.5, abs=0.06)
    assert y[~lit].max() == pytest.approx(1.5, abs=0.06)


def test_under_a_wide_cover_only_the_bounce_is_left() -> None:
    cover = Face("cover", (-50.0, -50.0, 0.5), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 100.0, 100.0)
    light = light_map(FLOOR, FaceArrays.of((FLOOR, cover)), NOON, 0.5).irradiance
    np.testing.assert_allclose(light, BOUNCE, rtol=0.02)
