import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from schemas.flight_plan import FlightPlan, Waypoint
from schemas.mission import MissionItem, mission_items
from schemas.vehicle import Vehicle
from tasks.simulation.trajectory import GUST_M, STEP_S, Flown, fly_mission
from tests.flight.wall_plan import wall_plan


def flown(plan: FlightPlan, seed: int = 1, items: tuple[MissionItem, ...] | None = None) -> Flown:
    return fly_mission(items or mission_items(plan), plan.origin, plan.home_m, plan.vehicle, seed)


def exact(**limits: float) -> Vehicle:
    return Vehicle(position_bias_m=0.0, position_jitter_m=0.0, **limits)


def test_depends_on_mission_and_seed_alone() -> None:
    one, two, other = flown(wall_plan(), 1), flown(wall_plan(), 1), flown(wall_plan(), 2)
    assert one.shots == two.shots
    assert np.array_equal(one.true_m, two.true_m)
    assert not np.array_equal(one.true_m, other.true_m)


def test_takes_every_photo_near_its_planned_pose() -> None:
    plan = wall_plan()
    shots = flown(plan).shots
    assert [s.photo for s in shots] == [w.photo for w in plan.shooting_points]
    for shot, way in zip(shots, plan.shooting_points, strict=True):
        off_m = np.linalg.norm(np.subtract(shot.estimated_pose.position_m, way.position_m))
        assert off_m < 5 * GUST_M
        assert abs((shot.true_pose.yaw_deg - way.yaw_deg + 180) % 360 - 180) < 5.0  # 2° + compass
        assert abs(shot.true_pose.pitch_deg - way.pitch_deg) < 1.5
        assert np.linalg.norm(shot.velocity_m_s) < 0.6


def test_true_position_is_off_by_bias_and_jitter() -> None:
    vehicle = Vehicle(position_bias_m=0.3, position_jitter_m=0.05)
    errors = []
    for seed in range(150):  # a flight is about one independent sample of the bias
        f = flown(wall_plan(1, 1, vehicle), seed)
        errors.append((f.estimated_m - f.true_m)[:: int(10 / STEP_S), :2])
    spread = np.vstack(errors).std(axis=0)
    assert spread == pytest.approx([np.hypot(0.3, 0.05)] * 2, rel=0.2)


def test_heights_count_from_take_off() -> None:
    f = flown(wall_plan(vehicle=Vehicle(position_bias_m=1.0, position_jitter_m=0.0)))
    assert (f.estimated_m - f.true_m)[0, 2] == pytest.approx(0.0, abs=1e-12)
    assert np.abs((f.estimated_m - f.true_m)[0, :2]).max() > 0.01


def test_bias_walks_slowly_and_jitter_quickly() -> None:
    slow = flown(wall_plan(vehicle=Vehicle(position_bias_m=0.3, position_jitter_m=0.0)))
    quick = flown(wall_plan(vehicle=Vehicle(position_bias_m=0.0, position_jitter_m=0.3)))
    for f, limit in ((slow, 0.1), (quick, 3.0)):
        change = np.diff((f.estimated_m - f.true_m)[:, 0]) / STEP_S
        assert np.sqrt((change**2).mean()) < limit
    assert np.sqrt((change**2).mean()) > 0.1


@settings(max_examples=15)
@given(
    speed=st.floats(0.3, 8.0),
    acceleration=st.floats(0.3, 4.0),
    yaw_rate=st.floats(15.0, 120.0),
    seed=st.integers(0, 1000),
)
def test_keeps_its_limits(speed: float, acceleration: float, yaw_rate: float, seed: int) -> None:
    vehicle = exact(speed_m_s=speed, acceleration_m_s2=acceleration, yaw_rate_deg_s=yaw_rate)
    f = flown(wall_plan(2, 1, vehicle), seed)
    gusts_m_s, gusts_m_s2 = 6 * GUST_M, 12 * GUST_M / STEP_S**0.5
    velocity = np.diff(f.true_m, axis=0) / STEP_S
    assert np.linalg.norm(velocity, axis=1).max() < speed + gusts_m_s
    assert np.linalg.norm(np.diff(velocity, axis=0) / STEP_S, axis=1).max() < acceleration + gusts_m_s2
    turned = np.abs(np.diff(f.estimated_yaw_deg)) / STEP_S
    assert turned.max() < yaw_rate + 6 * 0.3 / 0.5


def test_without_a_commanded_speed_it_flies_at_its_own() -> None:
    """As ArduCopter: its own 10 m/s leave acceleration alone to hold it back on the 6 m to the wall."""
    plan = wall_plan(vehicle=exact(speed_m_s=2.0, acceleration_m_s2=2.5))
    slow, careless = flown(plan), tuple(i for i in mission_items(plan) if i.command != 178)
    fast = flown(plan, items=careless)
    top_m_s = [np.linalg.norm(np.diff(f.estimated_m, axis=0), axis=1).max() / STEP_S for f in (slow, fast)]
    assert top_m_s[0] < 2.0 + 6 * GUST_M
    assert top_m_s[1] > 3.5


def test_holds_before_the_shutter() -> None:
    plan = wall_plan(vehicle=exact(hold_s=2.0))
    f = flown(plan)
    for shot, way in zip(f.shots[:8], plan.shooting_points, strict=False):
        held = (f.time_s > shot.time_s - 1.5) & (f.time_s < shot.time_s)
        off_m = np.linalg.norm(f.estimated_m[held] - way.position_m, axis=1)
        assert off_m.max() < 5 * GUST_M


def test_takes_off_and_lands_at_home() -> None:
    plan = wall_plan(vehicle=exact())
    f = flown(plan)
    for end in (0, -1):
        assert np.linalg.norm(f.true_m[end] - plan.home_m) < 5 * GUST_M
    assert f.true_m[:, 2].max() == pytest.approx(4.0, abs=5 * GUST_M)


def test_stops_at_every_waypoint_and_rounds_those_without_a_hold() -> None:
    """As ArduCopter, which is then off the path, the only place that is known to be free."""
    plan = wall_plan(vehicle=exact(hold_s=0.0))
    corner = Waypoint(kind="intermediate", position_m=(4.0, -10.0, 4.0), yaw_deg=0.0)
    plan = plan.model_copy(update={"waypoints": (plan.waypoints[0], corner, *plan.waypoints[1:])})
    corners = (corner, plan.waypoints[5])  # and the end of the wall's first row, after a short leg
    waypoint = mavlink.MAV_CMD_NAV_WAYPOINT
    careless = tuple(
        i.model_copy(update={"param1": 0.0}) if i.command == waypoint else i for i in mission_items(plan)
    )
    stops, rounds = flown(plan), flown(plan, items=careless)
    for way, rounded_m in zip(corners, (0.3, 0.08), strict=True):
        off_m = [np.linalg.norm(f.estimated_m - way.position_m, axis=1).min() for f in (stops, rounds)]
        assert off_m[0] < 0.05 < rounded_m < off_m[1] < 2.0
    step_m = np.linalg.norm(np.diff(rounds.estimated_m, axis=0), axis=1)
    assert step_m.max() < (2.0 + 6 * GUST_M) * STEP_S
    assert rounds.reached[-1][1] < stops.reached[-1][1]


def test_a_mission_without_yaw_commands_looks_along_its_path() -> None:
    """As ArduCopter: the photos of a wall passed sideways show the sky beside it."""
    plan = wall_plan(vehicle=exact())
    careless = tuple(i for i in mission_items(plan) if i.command != mavlink.MAV_CMD_CONDITION_YAW)
    f = flown(plan, items=careless)
    assert [round(s.true_pose.yaw_deg / 90) % 4 for s in f.shots[1:3]] == [1, 1]  # east, not north


def test_photos_at_the_height_of_home_are_taken_there() -> None:
    """From a deck, say. ArduCopter takes a height of 0 for none and stays as high as it is."""
    plan = wall_plan(vehicle=exact())
    at_home = tuple(
        w.model_copy(update={"position_m": (*w.position_m[:2], plan.home_m[2])}) if w.photo else w
        for w in plan.waypoints
    )
    plan = plan.model_copy(update={"waypoints": at_home})
    for shot in flown(plan).shots:
        assert shot.estimated_pose.position_m[2] == pytest.approx(plan.home_m[2], abs=0.1)


def test_a_change_of_pitch_alone_does_not_turn_the_nose() -> None:
    """Up to 4.5 ArduCopter takes the yaw of DO_MOUNT_CONTROL, 0, for a heading if the gimbal does not pan."""
    plan = wall_plan(2, 1, exact())
    ways = [w.model_copy(update={"yaw_deg": 90.0}) for w in plan.waypoints]
    ways[2] = ways[2].model_copy(update={"pitch_deg": 40.0})
    plan = plan.model_copy(update={"waypoints": tuple(ways)})
    for shot, way in zip(flown(plan).shots, plan.shooting_points, strict=True):
        assert abs(shot.estimated_pose.yaw_deg - 90.0) < 2.5
        assert np.linalg.norm(np.subtract(shot.estimated_pose.position_m, way.position_m)) < 5 * GUST_M


def test_a_late_turn_delays_the_trigger_until_the_nose_is_there() -> None:
    """CONDITION_YAW holds the trigger back while the vehicle already leaves for the next point."""
    plan = wall_plan(1, 1, exact(yaw_rate_deg_s=45.0))
    items = list(mission_items(plan))
    yaw = mavlink.MAV_CMD_CONDITION_YAW
    turns = [k for k, i in enumerate(items) if i.command == yaw and i.param1 == 120.0]
    holds = [i.model_copy(update={"param1": 1.0}) if i.param1 and i.command == 16 else i for i in items]
    del holds[turns[0]]  # the one on the way: only the one after the hold is left
    shot = flown(plan, items=tuple(holds)).shots[-1]
    assert abs(shot.estimated_pose.yaw_deg - 120.0) < 4.0
    planned_m = plan.shooting_points[-1].position_m
    assert np.linalg.norm(np.subtract(shot.estimated_pose.position_m, planned_m)) > 1.0


def test_a_trigger_still_waiting_at_the_next_waypoint_is_dropped() -> None:
    plan = wall_plan(1, 1, exact(yaw_rate_deg_s=2.0))
    items = [
        i.model_copy(update={"param1": 1.0}) if i.param1 and i.command == 16 else i
        for i in mission_items(plan)
    ]
    assert len(flown(plan, items=tuple(items)).shots) == 1
    assert len(flown(plan).shots) == 2  # the planned hold is long enough for the turn
