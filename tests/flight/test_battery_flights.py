"""Plans of several flights: logs in any order, several flights in one log, and a model turned from north."""

import numpy as np
import pytest

from artifacts import store
from schemas.flight_log import joined
from schemas.flight_plan import Flight, FlightPlan
from schemas.mission import mission_items
from tasks.flight.battery_flights import BATTERY_S, compare_with_flights, flights_in
from tasks.flight.recording import Fix, Recording, Trigger
from tasks.flight.task import fly, import_log
from tasks.simulation.trajectory import fly_mission
from tasks.simulation.vehicle import start_vehicle
from tests.flight.wall_plan import ORIGIN, wall_plan


def two_flights() -> FlightPlan:
    """The wall's two rows, a flight each, in a model that is turned from north."""
    one = wall_plan(4, 2)
    up = one.waypoints[0]
    waypoints = (*one.waypoints[:5], up, up, *one.waypoints[5:])
    flights = tuple(
        Flight(first=first, last=last, photos=photos, length_m=1.0, duration_s=1.0, battery=0.1)
        for first, last, photos in ((0, 5, 4), (6, len(waypoints) - 1, 5))
    )
    turned = ORIGIN.model_copy(update={"heading_deg": 237.5})
    return one.model_copy(update={"waypoints": waypoints, "flights": flights, "origin": turned})


PLAN = two_flights()


def recording(legs: tuple[FlightPlan, ...], pause_s: float) -> Recording:
    """One log of these flights, flown exactly at 1 m a second, a trigger at each shooting point."""
    made, now = Recording(), 0.0
    for leg in legs:
        start = now
        for waypoint in leg.waypoints:
            now += 5.0
            latitude, longitude, altitude = leg.origin.to_geographic(waypoint.position_m)
            height = waypoint.position_m[2] - leg.home_m[2]
            yaw = leg.origin.compass_deg(waypoint.yaw_deg)
            fix = Fix(now, latitude, longitude, altitude, height, yaw)
            made.fixes.append(fix)
            if waypoint.kind == "shooting":
                made.triggers.append(Trigger(fix, 0.0, None))
        made.armed_s.append((start, now))
        now += pause_s
    return made


def test_logs_of_a_turned_model_in_any_order_show_every_photo(own_store: store.Store) -> None:
    logs = []
    for number, leg in enumerate(PLAN.each_flight):
        with start_vehicle(leg, 3 + number) as url:
            flown = fly.bare(leg, str(number), url, 10.0)
        true = fly_mission(mission_items(leg), leg.origin, leg.home_m, leg.vehicle, seed=3 + number)
        for shot, exact in zip(flown.shots, true.shots, strict=True):
            assert shot.pose.position_m == pytest.approx(exact.estimated_pose.position_m, abs=0.012)
            assert shot.pose.yaw_deg == pytest.approx(exact.estimated_pose.yaw_deg, abs=0.01)
        planned = np.array([w.position_m for w in leg.shooting_points])
        shot_from = np.array([shot.pose.position_m for shot in flown.shots])
        assert np.abs(shot_from - planned).max() < 0.5  # in the model's frame, however that is turned
        logs.append(import_log.bare(flown.archive, f"{number}.mcap", PLAN))
    both = joined(logs[::-1])
    assert sorted(s.photo for s in both.shots) == sorted(w.photo or "" for w in PLAN.shooting_points)
    assert not both.missed
    assert len(both.later_archives) == 1


def test_one_log_may_hold_several_flights() -> None:
    found = compare_with_flights(recording(PLAN.each_flight, 2 * BATTERY_S), PLAN, "both.tlog")
    assert [len(one.shots) for one in found] == [4, 5]
    assert not any(one.missed for one in found)
    assert all(one.errors[0].rms_m < 0.05 for one in found)


def test_a_short_stop_is_no_change_of_battery() -> None:
    made = recording(PLAN.each_flight, BATTERY_S / 2)
    assert [len(part.fixes) for part in flights_in(made)] == [len(made.fixes)]


def test_the_second_flight_alone_is_known_for_what_it_is() -> None:
    (found,) = compare_with_flights(recording(PLAN.each_flight[1:], 0.0), PLAN, "second.tlog")
    assert [s.photo for s in found.shots] == [w.photo for w in PLAN.each_flight[1].shooting_points]
