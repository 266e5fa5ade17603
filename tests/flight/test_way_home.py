"""A failsafe's way home on the simulated vehicle, before and after a flight."""

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.flight_plan import FlightPlan
from schemas.mission import mission_items
from tasks.flight.fly import Flight
from tasks.flight.link import Link
from tasks.flight.parameters import read_parameters, set_parameter
from tasks.flight.task import flight_pages, fly
from tasks.flight.way_home import PRESUMED, WayHome
from tasks.planning.way_home import CONE
from tasks.simulation.autopilot import Faults
from tasks.simulation.vehicle import start_vehicle
from tests.flight.wall_plan import wall_plan

NOWHERE = wall_plan(3, 1)
PLAN = NOWHERE.model_copy(update={"return_height_m": 8.5})


def height_of(link: Link) -> tuple[str, float]:
    (message,) = read_parameters(link, [("RTL_ALT", "RTL_ALT_M")]).values()
    return message.param_id, message.param_value


@pytest.mark.parametrize(
    ("in_metres", "own", "planned"),
    [(False, ("RTL_ALT", 1500.0), 850.0), (True, ("RTL_ALT_M", 15.0), 8.5)],
)
def test_the_plan_s_height_is_set_and_given_back(
    in_metres: bool, own: tuple[str, float], planned: float
) -> None:
    with start_vehicle(PLAN, 1, Faults(in_metres=in_metres)) as url, Link(url, 5.0) as link:
        link.find_vehicle()
        assert height_of(link) == own
        way_home = WayHome(link, PLAN)
        assert height_of(link) == (own[0], planned)
        assert way_home.told == [
            f"{own[0]} set from {own[1]:g} to {planned:g}: the plan's height, 8.5 m, at which its way home is"
            " known to be free"
        ]
        way_home.give_back()
        assert height_of(link) == own
        assert way_home.told[1:] == [f"Landed: {own[0]} is {own[1]:g} again"]


def test_a_vehicle_that_has_the_height_is_left_alone() -> None:
    with start_vehicle(PLAN, 1, Faults(parameters=(("RTL_ALT", 850.0),))) as url, Link(url, 5.0) as link:
        link.find_vehicle()
        way_home = WayHome(link, PLAN)
        way_home.give_back()
        assert way_home.told == []
        assert height_of(link) == ("RTL_ALT", 850.0)


def test_over_a_link_that_loses_30_percent_each_way() -> None:
    with start_vehicle(PLAN, 1, Faults(loss=0.3)) as url, Link(url, 10.0) as link:
        link.find_vehicle()
        assert "RTL_ALT set from 1500 to 850" in WayHome(link, PLAN).told[0]


def test_another_way_home_than_was_checked_is_told() -> None:
    other = Faults(parameters=(("RTL_ALT", 850.0), ("RTL_CONE_SLOPE", 0.0), ("RTL_CLIMB_MIN", 400.0)))
    with start_vehicle(PLAN, 1, other) as url, Link(url, 5.0) as link:
        link.find_vehicle()
        assert WayHome(link, PLAN).told == [
            "RTL_CONE_SLOPE is 0: the plan's way home was checked for 3",
            "RTL_CLIMB_MIN is 400: the plan's way home was checked for 0",
        ]


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ((), "The vehicle has FS_THR_ENABLE 1: that failsafe"),
        (
            (("FS_THR_ENABLE", 3.0), ("BATT_FS_LOW_ACT", 2.0)),
            "The vehicle has BATT_FS_LOW_ACT 2: that failsafe",
        ),
        ((("FS_THR_ENABLE", 5.0), ("FENCE_ENABLE", 1.0)), "The vehicle has FENCE_ACTION 1: that failsafe"),
        ((("FS_THR_ENABLE", 5.0),), None),
    ],
)
def test_failsafes_that_come_straight_home_are_told_where_no_height_is_free(
    parameters: tuple[tuple[str, float], ...], told: str | None
) -> None:
    with start_vehicle(NOWHERE, 1, Faults(parameters=parameters)) as url, Link(url, 5.0) as link:
        link.find_vehicle()
        found = WayHome(link, NOWHERE).told
        assert len(found) == (told is not None)
        assert told is None or found[0].startswith(told)


@pytest.mark.parametrize(("disarms", "height"), [(True, 1500.0), (False, 850.0)])
def test_a_vehicle_that_does_not_disarm_may_fly_and_keeps_the_plan_s_height(
    disarms: bool, height: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    with start_vehicle(PLAN, 1) as url, Link(url, 5.0) as link:
        flight = Flight(link, PLAN, mission_items(PLAN))
        flight.prepare()
        denied = mavlink.MAV_RESULT_FAILED
        if not disarms:
            monkeypatch.setattr(link, "command", lambda command, *params, **how: denied)
        flight.stand_down()
        assert height_of(link) == ("RTL_ALT", height)


def test_the_way_home_is_checked_for_the_cone_that_the_plan_presumes() -> None:
    assert PRESUMED[("RTL_CONE_SLOPE",)] == CONE


def test_an_unknown_parameter_is_not_waited_for_without_end() -> None:
    with start_vehicle(PLAN, 1) as url, Link(url, 30.0) as link:
        link.find_vehicle()
        assert read_parameters(link, [("NO_SUCH",)]) == {}
        found = read_parameters(link, [("RTL_ALT",)])["RTL_ALT"]
        found.param_id = "NO_SUCH"
        assert not set_parameter(link, found, 1.0)


@pytest.mark.parametrize("plan", [PLAN, NOWHERE], ids=["a height", "no height"])
def test_a_flight_says_what_it_set(plan: FlightPlan) -> None:
    with start_vehicle(plan, 1) as url:
        log = fly.bare(plan, "1", url, 5.0)
        with Link(url, 5.0) as link:
            link.find_vehicle()
            assert height_of(link) == ("RTL_ALT", 1500.0)
    (page,) = (page for page in flight_pages({}, log) if page.key == "flight")
    assert page.markdown is not None
    told = "RTL_ALT set from 1500 to 850" if plan is PLAN else "The vehicle has FS_THR_ENABLE 1"
    assert f"- way home: {told}" in page.markdown
    assert len(log.way_home) == (2 if plan is PLAN else 1)
