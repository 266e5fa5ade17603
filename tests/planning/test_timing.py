"""Times against the equations of motion, integrated."""

import numpy as np
import pytest

from schemas.vehicle import Vehicle
from tasks.planning.timing import travel_s, turn_s


@pytest.mark.parametrize("distance", [0.3, 2.0, 4.0, 25.0])
def test_travel_from_stop_to_stop(distance: float) -> None:
    vehicle = Vehicle(speed_m_s=2.0, acceleration_m_s2=1.0)
    seconds = float(travel_s(distance, vehicle))
    time = np.linspace(0, seconds, 20001)
    speed = np.minimum(vehicle.speed_m_s, vehicle.acceleration_m_s2 * np.minimum(time, seconds - time))
    assert np.trapezoid(speed, time) == pytest.approx(distance, rel=1e-3)


def test_turns_go_the_shorter_way() -> None:
    vehicle = Vehicle(yaw_rate_deg_s=45.0)
    assert float(turn_s(350.0, 10.0, vehicle)) == pytest.approx(20 / 45)
    assert float(turn_s(90.0, 270.0, vehicle)) == pytest.approx(4.0)
