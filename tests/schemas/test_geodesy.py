"""The local frame against exact earth-centred coordinates."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M, GeoOrigin


def earth_centred(latitude_deg: float, longitude_deg: float, height_m: float) -> np.ndarray:
    phi, lam = np.radians([latitude_deg, longitude_deg])
    radius = SEMI_MAJOR_M / math.sqrt(1 - ECCENTRICITY_SQUARED * math.sin(phi) ** 2)
    flat = (radius + height_m) * math.cos(phi)
    up = (radius * (1 - ECCENTRICITY_SQUARED) + height_m) * math.sin(phi)
    return np.array([flat * math.cos(lam), flat * math.sin(lam), up])


@pytest.mark.parametrize("latitude", [-65.0, -35.0, 0.0, 50.0, 65.0])
@pytest.mark.parametrize("altitude", [0.0, 1500.0])
@pytest.mark.parametrize(("distance", "aside_m"), [(100.0, 0.0021), (500.0, 0.051)])
def test_it_is_as_exact_as_it_says(latitude: float, altitude: float, distance: float, aside_m: float) -> None:
    origin = GeoOrigin(latitude_deg=latitude, longitude_deg=10.0, altitude_m=altitude)
    phi, lam = np.radians([latitude, 10.0])
    to_enu = np.array(
        [
            [-math.sin(lam), math.cos(lam), 0.0],
            [-math.sin(phi) * math.cos(lam), -math.sin(phi) * math.sin(lam), math.cos(phi)],
            [math.cos(phi) * math.cos(lam), math.cos(phi) * math.sin(lam), math.sin(phi)],
        ]
    )
    for angle in np.linspace(0, 2 * np.pi, 17):
        place = (distance * math.sin(angle), distance * math.cos(angle), 10.0)
        there = earth_centred(*origin.to_geographic(place))
        exact = to_enu @ (there - earth_centred(latitude, 10.0, altitude))
        assert np.hypot(*(exact - place)[:2]) <= aside_m
        assert exact[2] - place[2] == pytest.approx(-(distance**2) / (2 * SEMI_MAJOR_M), rel=0.02)


@given(st.floats(-500, 500), st.floats(-500, 500), st.floats(-100, 500), st.floats(-80, 80))
def test_there_and_back(east: float, north: float, up: float, latitude: float) -> None:
    origin = GeoOrigin(latitude_deg=latitude, longitude_deg=-120.0, altitude_m=300.0)
    assert origin.to_enu(*origin.to_geographic((east, north, up))) == pytest.approx(
        (east, north, up), abs=1e-6
    )
